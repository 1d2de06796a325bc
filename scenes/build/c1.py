"""Scene c1 of the slides: three coloured spheres in a closed box under a ceiling light."""

from common import BLUE, RED, WHITE, camera, ceiling_light, diffuse, finish, quad, sphere, start

MIDDLE = (0, 0.5, 0)


def build() -> None:
    """Numbers as published; walls face inwards."""
    start("c1", resolution=250, max_bounces=9)
    white = diffuse("White", WHITE)
    quad("Left", (-1.5, 0, -1.5), (-1.5, 1, 1.5), MIDDLE, diffuse("Red", RED))
    quad("Right", (1.5, 0, -1.5), (1.5, 1, 1.5), MIDDLE, diffuse("Blue", BLUE))
    quad("Floor", (-1.5, 0, -1.5), (1.5, 0, 1.5), MIDDLE, white)
    quad("Ceiling", (-1.5, 1, -1.5), (1.5, 1, 1.5), MIDDLE, white)
    quad("Front", (-1.5, 0, -1.5), (1.5, 1, -1.5), MIDDLE, white)
    quad("Back", (-1.5, 0, 1.5), (1.5, 1, 1.5), MIDDLE, white)
    ceiling_light((-0.3, 0.999, -0.4), (0.3, 0.999, 0.4), radiance=8.0)
    sphere("Sphere left", (-0.6, 0.201, 0), 0.2, (0.75, 0.35, 0.35))
    sphere("Sphere middle", (0, 0.201, 0), 0.2, (0.25, 0.35, 0.65))
    sphere("Sphere right", (0.6, 0.201, 0), 0.2, (0.35, 0.85, 0.15))
    camera((0, 0.5, -1.3), MIDDLE, vfov=70)


if __name__ == "__main__":
    build()
    finish()
