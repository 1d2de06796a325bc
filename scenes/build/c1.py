"""Scene c1 of the slides: three coloured spheres in a closed box under a ceiling light. Numbers as published."""

from common import camera, finish, light, room, sphere, start


def build() -> None:
    """Wide box, light in the ceiling."""
    start("c1", resolution=250, max_bounces=9)
    room((-1.5, 0, -1.5), (1.5, 1, 1.5))
    light((-0.3, 0.999, -0.4), (0.3, 0.999, 0.4), facing=(0, 0, 0), radiance=8.0)
    sphere("Sphere left", (-0.6, 0.201, 0), 0.2, (0.75, 0.35, 0.35))
    sphere("Sphere middle", (0, 0.201, 0), 0.2, (0.25, 0.35, 0.65))
    sphere("Sphere right", (0.6, 0.201, 0), 0.2, (0.35, 0.85, 0.15))
    camera((0, 0.5, -1.3), (0, 0.5, 0), vfov=70)


if __name__ == "__main__":
    build()
    finish()
