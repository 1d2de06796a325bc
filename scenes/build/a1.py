"""Scene a1 of the slides: two grey spheres in a Cornell box that is open towards the camera."""

from common import BLUE, RED, WHITE, camera, ceiling_light, diffuse, finish, quad, sphere, start

MIDDLE = (0.5, 0.5, 0.5)


def build() -> None:
    """Numbers as published; walls face inwards."""
    start("a1", resolution=256, max_bounces=19)
    white = diffuse("White", WHITE)
    quad("Left", (0, 0, 0), (0, 1, 1), MIDDLE, diffuse("Red", RED))
    quad("Right", (1, 0, 0), (1, 1, 1), MIDDLE, diffuse("Blue", BLUE))
    quad("Floor", (0, 0, 0), (1, 0, 1), MIDDLE, white)
    quad("Ceiling", (0, 1, 0), (1, 1, 1), MIDDLE, white)
    quad("Back", (0, 0, 1), (1, 1, 1), MIDDLE, white)
    ceiling_light((0.25, 0.999, 0.25), (0.75, 0.999, 0.75), radiance=5.0)
    sphere("Sphere left", (0.3, 0.101, 0.55), 0.1, WHITE)
    sphere("Sphere right", (0.7, 0.101, 0.35), 0.1, WHITE)
    camera((0.5, 0.5, -1.3), (0.5, 0.5, 0), vfov=40)


if __name__ == "__main__":
    build()
    finish()
