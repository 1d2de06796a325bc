"""Scene c2 of the slides: a large light in the ceiling over a block and five spheres. Numbers estimated by eye."""

from common import block, camera, finish, light, room, sphere, start


def build() -> None:
    """Wide box; the block is violet with a green top."""
    start("c2", resolution=250, max_bounces=9)
    room((-1.5, 0, -1.5), (1.5, 1, 1.5))
    light((-0.8, 0.999, -0.8), (0.8, 0.999, 0.8), facing=(0, 0, 0), radiance=2.0)
    block("Block", (0, 0, 0), (1.5, 0.4, 1.5), (0.24, 0.15, 0.65), top=(0.23, 0.72, 0.38))
    sphere("Sphere front left", (-0.2, 0.176, -0.3), 0.175, (0.51, 0.27, 0.16))
    sphere("Sphere front right", (0.3, 0.176, -0.3), 0.175, (0.11, 0.23, 0.56))
    sphere("Sphere back left", (-0.6, 0.301, 0.7), 0.3, (0.53, 0.23, 0.13))
    sphere("Sphere top left", (0.425, 0.556, 0.58), 0.155, (0.26, 0.81, 0.78))
    sphere("Sphere top right", (0.885, 0.556, 0.65), 0.155, (0.74, 0.29, 0.82))
    camera((0, 0.5, -1.3), (0, 0.5, 0), vfov=70)


if __name__ == "__main__":
    build()
    finish()
