"""Scene a2 of the slides: the back wall shines between two blocks, six spheres. Numbers estimated by eye."""

from common import block, camera, finish, light, room, sphere, start


def build() -> None:
    """A box twice as deep as wide, open towards the camera."""
    start("a2", resolution=256, max_bounces=19)
    room((0, 0, 0), (1, 1, 2), front=False)
    light((0, 0, 1.999), (1, 1, 1.999), facing=(0.5, 0.5, 0), radiance=5.3)
    block("Low block", (0, 0, 1), (0.25, 0.25, 1.25), (0.72, 0.78, 0.74))
    block("Tall block", (0.75, 0, 1), (1, 0.65, 1.25), (0.83, 0.82, 0.76))
    sphere("Sphere low", (0.126, 0.376, 1.125), 0.125, (0.24, 0.26, 0.76))
    sphere("Sphere tall", (0.874, 0.776, 1.125), 0.125, (0.76, 0.25, 0.26))
    sphere("Sphere left front", (0.126, 0.126, 0.55), 0.125, (0.93, 0.95, 0.34))
    sphere("Sphere left back", (0.126, 0.126, 0.8), 0.125, (0.72, 0.27, 0.27))
    sphere("Sphere right front", (0.874, 0.126, 0.55), 0.125, (0.32, 0.93, 0.33))
    sphere("Sphere right back", (0.874, 0.126, 0.8), 0.125, (0.29, 0.29, 0.86))
    camera((0.5, 0.5, -1.3), (0.5, 0.5, 0), vfov=40)


if __name__ == "__main__":
    build()
    finish()
