"""Scene b2 of the slides: fourteen spheres on the floor and under the ceiling, the right wall shines.

Numbers as published, except the light. Published is z in [-1, 1], but then the front is up to four times brighter than in the
published picture. Here z is in [0.06, 1], fitted to that picture.
"""

from common import camera, finish, light, room, sphere, start


def build() -> None:
    """Wide box, light on the right wall."""
    start("b2", resolution=192, max_bounces=9)
    room((-1.5, 0, -1.5), (1.5, 1, 1.5))
    light((1.499, 0, 0.06), (1.499, 1, 1), facing=(0, 0, 0), radiance=8.0)
    sphere("Sphere 1", (0.5, 0.251, 0.75), 0.25, (0.67, 0.13, 0.25))
    sphere("Sphere 2", (-0.5, 0.251, 0.75), 0.25, (0.23, 0.65, 0.49))
    sphere("Sphere 3", (0, 0.201, 0.2), 0.2, (0.57, 0.15, 0.79))
    sphere("Sphere 4", (-0.9, 0.201, 0.2), 0.2, (0.17, 0.23, 0.45))
    sphere("Sphere 5", (0.9, 0.201, 0.2), 0.2, (0.53, 0.95, 0.49))
    sphere("Sphere 6", (0.6, 0.799, 0.4), 0.2, (0.12, 0.34, 0.67))
    sphere("Sphere 7", (-0.6, 0.799, 0.4), 0.2, (0.42, 0.54, 0.17))
    sphere("Sphere 8", (0, 0.749, 0.1), 0.25, (0.13, 0.54, 0.37))
    sphere("Sphere 9", (-0.4, 0.151, -0.2), 0.15, (0.13, 0.54, 0.37))
    sphere("Sphere 10", (0.4, 0.151, -0.2), 0.15, (0.13, 0.54, 0.37))
    sphere("Sphere 11", (0.6, 0.849, -0.55), 0.15, (0.53, 0.54, 0.27))
    sphere("Sphere 12", (-0.6, 0.849, -0.55), 0.15, (0.23, 0.54, 0.77))
    sphere("Sphere 13", (0.6, 0.151, -0.55), 0.15, (0.29, 0.74, 0.57))
    sphere("Sphere 14", (-0.6, 0.151, -0.55), 0.15, (0.63, 0.14, 0.87))
    camera((0, 0.85, -1.3), (0, 0.6, 0), vfov=80)


if __name__ == "__main__":
    build()
    finish()
