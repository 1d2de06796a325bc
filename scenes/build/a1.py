"""Scene a1 of the slides: two grey spheres in a Cornell box that is open towards the camera. Numbers as published."""

from common import WHITE, camera, finish, light, room, sphere, start


def build() -> None:
    """Unit box, light in the ceiling."""
    start("a1", resolution=256, max_bounces=19)
    room((0, 0, 0), (1, 1, 1), front=False)
    light((0.25, 0.999, 0.25), (0.75, 0.999, 0.75), facing=(0.5, 0, 0.5), radiance=5.0)
    sphere("Sphere left", (0.3, 0.101, 0.55), 0.1, WHITE)
    sphere("Sphere right", (0.7, 0.101, 0.35), 0.1, WHITE)
    camera((0.5, 0.5, -1.3), (0.5, 0.5, 0), vfov=40)


if __name__ == "__main__":
    build()
    finish()
