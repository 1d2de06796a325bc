"""Scene c3 of the slides: light from behind a low wall, three spheres. Numbers estimated by eye."""

from common import camera, diffuse, finish, light, quad, room, sphere, start


def build() -> None:
    """Wide box; the low wall ends at the height of the eye."""
    start("c3", resolution=250, max_bounces=9)
    room((-1.5, 0, -1.5), (1.5, 1, 1.5))
    quad("Low wall", (-1.25, 0, 1.1), (1.25, 0.5, 1.1), (0, 0, 0), diffuse("Low wall", (0.17, 0.23, 0.45)))
    light((-1.25, 0, 1.102), (1.25, 0.5, 1.102), facing=(0, 0, 1.5), radiance=19.4)
    sphere("Sphere left", (-0.5, 0.201, 0.1), 0.2, (0.32, 0.22, 0.14))
    sphere("Sphere middle", (0, 0.201, 0.3), 0.2, (0.71, 0.13, 0.6))
    sphere("Sphere right", (0.5, 0.201, 0.1), 0.2, (0.14, 0.67, 0.32))
    camera((0, 0.5, -1.3), (0, 0.5, 0), vfov=70)


if __name__ == "__main__":
    build()
    finish()
