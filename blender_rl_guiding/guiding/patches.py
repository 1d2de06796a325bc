"""The actions: equal patches of the hemisphere around the normal, rows x columns, each of solid angle 2 pi / N.

Rows split cos(theta) evenly, columns phi, in the local frame of `sampling.tangents`; patch a = row * columns + column.
"""

import math

import numpy as np

from ..kernels import part
from ..sampling import TWO_PI, F, circle


@part
def patch_of(rows, columns, wi):
    """The patch that the local direction wi passes through; directions below the horizon count to the lowest row."""
    row = min(max(int(wi[2] * F(rows)), 0), rows - 1)
    turn = math.atan2(wi[1], wi[0]) / TWO_PI
    column = int((turn + F(1) if turn < F(0) else turn) * F(columns))
    return row * columns + min(column, columns - 1)


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
