"""Scene b3 of the slides: eight spheres on the floor and under the ceiling, three lights in the back. Numbers estimated by eye."""

from common import WHITE, block, camera, finish, light, room, sphere, start


def build() -> None:
    """Wide box; the light to the right is the front of a block."""
    start("b3", resolution=192, max_bounces=9)
    room((-1.5, 0, -1.5), (1.5, 1, 1.5))
    light((-1.5, 0, 1.38), (-0.66, 1, 1.38), facing=(0, 0, 0), radiance=2.9)
    light((-0.165, 0, 0.999), (0.165, 1, 0.999), facing=(0, 0, 0), radiance=2.2)
    light((0.75, 0, 0.999), (1.5, 1, 0.999), facing=(0, 0, 0), radiance=6.5)
    block("Middle block", (-0.165, 0, 1), (0.165, 1, 1.5), WHITE)
    block("Block", (0.75, 0, 1), (1.5, 1, 1.5), (0.16, 0.11, 0.2))
    sphere("Sphere 1", (0, 0.251, -0.35), 0.25, (0.78, 0.47, 0.23))
    sphere("Sphere 2", (-0.7, 0.201, -0.3), 0.2, (0.13, 0.63, 0.83))
    sphere("Sphere 3", (0.7, 0.201, -0.4), 0.2, (0.45, 0.26, 0.23))
    sphere("Sphere 4", (-0.506, 0.226, 0.62), 0.225, (0.66, 0.18, 0.33))
    sphere("Sphere 5", (0.492, 0.226, 0.562), 0.225, (0.11, 0.47, 0.56))
    sphere("Sphere 6", (0, 0.849, -0.3), 0.15, (0.23, 0.4, 0.11))
    sphere("Sphere 7", (-0.9, 0.799, -0.05), 0.2, (0.34, 0.52, 0.23))
    sphere("Sphere 8", (0.9, 0.799, -0.05), 0.2, (0.58, 0.26, 0.12))
    camera((0, 0.85, -1.3), (0, 0.6, 0), vfov=80)


if __name__ == "__main__":
    build()
    finish()
