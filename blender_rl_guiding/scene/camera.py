"""Camera rays."""

from typing import NamedTuple

import numpy as np

from ..kernels import kernel
from ..sampling import F, normalize, store, stream, uniform2
from .data import SceneData


class Pinhole(NamedTuple):
    """A camera as the kernels see it: the film plane at distance 1 in world space."""

    position: np.ndarray  # (3,) float32
    corner: np.ndarray  # (3,) float32, from position to the top left corner of the film
    right: np.ndarray  # (3,) float32, one pixel to the right
    down: np.ndarray  # (3,) float32, one pixel down
    width: int


def pinhole(scene: SceneData) -> Pinhole:
    """The scene's camera for `camera_rays`."""
    camera = scene.camera
    matrix = np.array(camera.to_world)
    x, y, z = matrix[:3, 0] * camera.tan_x, matrix[:3, 1] * camera.tan_y, matrix[:3, 2]
    right, down = 2 * x / camera.width, -2 * y / camera.height
    position, corner, right, down = (np.ascontiguousarray(v, np.float32) for v in (matrix[:3, 3], y - x - z, right, down))
    return Pinhole(position, corner, right, down, camera.width)


@kernel
def camera_rays(camera, seed, pixels, first_path, first_sample, count, paths):
    """Start `count` paths: path p is sample first_sample + p // pixels of pixel p % pixels, jittered over the pixel (box filter)."""
    c, r, d = camera.corner, camera.right, camera.down
    for i in range(count):
        path = first_path + i
        pixel = path % pixels
        key = stream(seed, pixel, first_sample + path // pixels)
        u, v = uniform2(key, 0)
        x, y = F(pixel % camera.width) + u, F(pixel // camera.width) + v
        direction = normalize((c[0] + x * r[0] + y * d[0], c[1] + x * r[1] + y * d[1], c[2] + x * r[2] + y * d[2]))
        store(paths.origin, i, (camera.position[0], camera.position[1], camera.position[2]))
        store(paths.direction, i, direction)
        store(paths.throughput, i, (F(1), F(1), F(1)))
        paths.pdf[i] = F(0)
        paths.key[i] = key
        paths.path[i] = path
