"""Simplify's texture limit, which Blender leaves to the render engine."""

import bpy
import numpy as np


def texture_limit(scene: bpy.types.Scene) -> int:
    """The maximal number of texels along a side of a texture in a render; 0 is no limit."""
    if not (scene.render.use_simplify and hasattr(scene, "cycles")):
        return 0
    limit = scene.cycles.texture_limit_render
    return int(limit) if limit.isdigit() else 0


def is_above(limit: int, width: int, height: int) -> bool:
    """Whether a texture is larger than the limit allows."""
    return 0 < limit < max(width, height)


def shrunk(texels: np.ndarray, limit: int, *, multiply: bool) -> np.ndarray:
    """(H, W, 4) texels, halved until no side is above the limit. A texel is the mean of a 2 x 2 square, for both codes and floats, as in
    Cycles.

    `multiply`: multiply colours by alpha first. Squares begin at the bottom left; incomplete squares are left out.
    """
    height, width, channels = texels.shape
    size = 1
    while is_above(limit * size, width, height):
        size *= 2
    down, across = min(size, height), min(size, width)
    rows, columns = height // down, width // across
    texels = _multiplied(texels) if multiply else texels
    squares = texels[height - rows * down :, : columns * across].reshape(rows, down, columns, across, channels)
    means = squares.mean(axis=(1, 3), dtype=np.float32)
    return np.floor(means + np.float32(0.5)).astype(np.uint8) if texels.dtype == np.uint8 else means


def _multiplied(texels: np.ndarray) -> np.ndarray:
    """Colours times alpha; codes are rounded down, as on reading."""
    result, alpha = texels.copy(), texels[..., 3:]
    if texels.dtype == np.uint8:
        result[..., :3] = texels[..., :3].astype(np.uint16) * alpha // 255
    else:
        result[..., :3] *= alpha
    return result
