"""Emitting triangles: picking a point on one, and the pdf of having picked it."""

from typing import NamedTuple

import numpy as np

from ..kernels import kernel
from ..sampling import F, pick, uniform_triangle
from .data import SceneData


class Lights(NamedTuple):
    """The emitting triangles, picked in proportion to area times luminance; none if `cdf` is (1, 0)."""

    cdf: np.ndarray  # (1, L) float32, cumulative probability
    corners: np.ndarray  # (L, 3, 3) float32
    triangle: np.ndarray  # (L,) int32, index in the scene
    pdf_area: np.ndarray  # (M,) float32, pdf per area of a point on a surface of material m


def lights(scene: SceneData) -> Lights:
    """The scene's emitting triangles for the kernels."""
    weight = np.array([m.emission for m in scene.materials]) @ (0.2126, 0.7152, 0.0722)
    triangle = np.flatnonzero(weight[scene.material] > 0).astype(np.int32)
    corners = scene.vertices[scene.triangles[triangle]]
    edges = (corners[:, 1:] - corners[:, :1]).astype(np.float64)
    area = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    power = area * weight[scene.material[triangle]]
    total = max(power.sum(), np.finfo(np.float32).tiny)
    cdf = (np.cumsum(power) / total).astype(np.float32)
    return Lights(cdf[None, :], corners, triangle, (weight / total).astype(np.float32))


@kernel
def sample_light(lights, u, v, w):
    """A point on an emitter: its position and its index in `lights`. Its pdf per area is `pdf_area` of its material."""
    i = pick(lights.cdf, 0, lights.cdf.shape[1], u)
    a, b = uniform_triangle(v, w)
    c, p = F(1) - a - b, lights.corners[i]
    x = c * p[0, 0] + a * p[1, 0] + b * p[2, 0]
    y = c * p[0, 1] + a * p[1, 1] + b * p[2, 1]
    z = c * p[0, 2] + a * p[1, 2] + b * p[2, 2]
    return (x, y, z), i
