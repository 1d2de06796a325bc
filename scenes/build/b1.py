"""Scene b1 of the slides: six spheres on a platform whose sides shine. Numbers estimated by eye."""

from common import block, camera, finish, light, room, sphere, start


def build() -> None:
    """Wide box; the platform's top is olive."""
    start("b1", resolution=192, max_bounces=9)
    room((-1.5, 0, -1.5), (1.5, 1, 1.5))
    block("Platform", (-1, 0, -1), (1, 0.2, 1), (0.56, 0.5, 0.12))
    light((-1, 0, -1.001), (1, 0.2, -1.001), facing=(0, 0, -1.5), radiance=6.9)
    light((-1, 0, 1.001), (1, 0.2, 1.001), facing=(0, 0, 1.5), radiance=5.1)
    light((-1.001, 0, -1), (-1.001, 0.2, 1), facing=(-1.5, 0, 0), radiance=6.2)
    light((1.001, 0, -1), (1.001, 0.2, 1), facing=(1.5, 0, 0), radiance=8.0)
    sphere("Sphere front", (0, 0.451, -0.6), 0.25, (0.23, 0.14, 0.81))
    sphere("Sphere middle", (0, 0.501, 0.6), 0.3, (0.53, 0.12, 0.77))
    sphere("Sphere left", (-0.7, 0.451, 0.5), 0.25, (0.22, 0.64, 0.5))
    sphere("Sphere right", (0.62, 0.451, 0.65), 0.25, (0.25, 0.26, 0.59))
    sphere("Sphere near left", (-0.7, 0.401, -0.5), 0.2, (0.77, 0.64, 0.11))
    sphere("Sphere near right", (0.7, 0.401, -0.5), 0.2, (0.35, 0.59, 0.71))
    camera((0, 0.85, -1.3), (0, 0.6, 0), vfov=80)


if __name__ == "__main__":
    build()
    finish()
