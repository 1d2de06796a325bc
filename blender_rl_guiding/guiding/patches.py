"""The actions: equal patches of the hemisphere around the normal, rows x columns, each of solid angle 2 pi / N.

Rows are equal steps of cos(theta), columns equal steps of phi, in the local frame of `sampling.tangents`.
Patch a = row * columns + column.
"""

import math

import numpy as np

from ..kernels import kernel, part
from ..kernels.sampling import TWO_PI, F, circle, place, tangents, to_local, vector
from ..scene.description import Camera


@part
def patch_of(rows, columns, wi):
    """The patch that the local direction wi passes through; directions below the horizon count as the lowest row."""
    turn = math.atan2(wi[1], wi[0]) / TWO_PI
    column = place((turn + F(1) if turn < F(0) else turn) * F(columns), columns)
    return place(wi[2] * F(rows), rows) * columns + column


@part
def sample_patch(rows, columns, patch, u, v):
    """A local direction uniform in the patch."""
    cos_theta = (F(patch // columns) + u) / F(rows)
    sin_theta = math.sqrt(max(F(0), F(1) - cos_theta * cos_theta))
    x, y = circle((F(patch % columns) + v) / F(columns))
    return sin_theta * x, sin_theta * y, cos_theta


def mean_cosines(rows: int, columns: int) -> np.ndarray:
    """The mean of cos(theta) over each patch, (rows * columns,) float32; exact, because rows split cos(theta) evenly."""
    return np.repeat((np.arange(rows, dtype=np.float32) + 0.5) / rows, columns).astype(np.float32)


@kernel
def patches_of(rows, columns, normal, direction, patches):
    """Write the patch that each direction passes through in the frame of its normal to `patches`, (n,) int64."""
    for i in range(normal.shape[0]):
        n = vector(normal, i)
        t, b = tangents(n)
        patches[i] = patch_of(rows, columns, to_local(t, b, n, vector(direction, i)))


def hemisphere(position: np.ndarray, normal: np.ndarray, rows: int, columns: int) -> Camera:
    """A camera at a surface point. Its pixels are the patches: its image is the mean incident radiance through each patch.

    The top row of pixels is the last row of patches, around the normal.
    """
    to_world = np.eye(4, dtype=np.float32)
    tangent_frame(np.float32(normal)[None], to_world)
    to_world[:3, 3] = position
    return Camera(tuple(map(tuple, to_world.tolist())), (0.0, 1.0, 0.0, 1.0), columns, rows, "hemisphere")


@kernel
def tangent_frame(normal, frame):
    """Write tangent, bitangent and the (1, 3) normal itself to the first columns of `frame`."""
    n = vector(normal, 0)
    t, b = tangents(n)
    for row in range(3):
        frame[row, 0], frame[row, 1], frame[row, 2] = t[row], b[row], n[row]
