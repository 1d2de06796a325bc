"""Scene a3 of the slides: light through a slit beside a wall, six spheres in two rows. Numbers estimated by eye."""

from common import WHITE, camera, diffuse, finish, light, quad, room, sphere, start


def build() -> None:
    """A box open towards the camera; its back wall shines behind a wall."""
    start("a3", resolution=256, max_bounces=19)
    room((0, 0, 0), (1, 1, 1.25), front=False)
    quad("Slit", (0.0005, 0, 1), (0.0005, 1, 1.25), (0.5, 0.5, 0), diffuse("Slit", (0.4, 0.15, 0.17)))
    quad("Wall", (0.3, 0, 1), (1, 1, 1), (0.5, 0.5, 0), diffuse("Wall", WHITE))
    light((0, 0, 1.249), (0.3, 1, 1.249), facing=(0.5, 0.5, 0), radiance=9.9)
    sphere("Sphere left front", (0.126, 0.126, 0.55), 0.125, (0.77, 0.83, 0.33))
    sphere("Sphere middle front", (0.5, 0.126, 0.55), 0.125, (0.29, 0.94, 0.71))
    sphere("Sphere right front", (0.874, 0.126, 0.55), 0.125, (0.29, 0.94, 0.36))
    sphere("Sphere left back", (0.126, 0.126, 0.85), 0.125, (0.7, 0.23, 0.27))
    sphere("Sphere middle back", (0.5, 0.126, 0.8), 0.125, (0.67, 0.6, 0.37))
    sphere("Sphere right back", (0.874, 0.126, 0.8), 0.125, (0.22, 0.24, 0.7))
    camera((0.5, 0.5, -1.3), (0.5, 0.5, 0), vfov=40)


if __name__ == "__main__":
    build()
    finish()
