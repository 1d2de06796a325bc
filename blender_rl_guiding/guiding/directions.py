"""A kind of directions: each cell of a hashed grid over position and normal has probabilities of equal patches of the hemisphere.

It draws only for diffuse reflection. Other lobes would need a product with the BSDF at each vertex.
"""

from typing import NamedTuple

import numpy as np

from ..bsdf.lobe import DIFFUSE_REFLECTION
from ..kernels import part
from ..kernels.bits import mix
from ..kernels.sampling import TWO_PI, F, pick, tangents, to_local, to_world
from .mixture import declare
from .patches import patch_of, sample_patch

NORMAL_STEPS = 2  # a normal's components are rounded to halves, so that no axis-aligned normal lies on a boundary
UNKNOWN = -1


class Cells(NamedTuple):
    """An open-addressed hash table from grid cells to rows. Its size is a power of two, and at least twice the number of rows."""

    origin: np.ndarray  # (3,) float32
    per_metre: np.float32  # cells per metre; 0 means that there is only one cell
    keys: np.ndarray  # (H,) uint64, 0 where free
    rows: np.ndarray  # (H,) int32


class Directions(NamedTuple):
    """The material draws the share `bsdf_fraction` of the samples. The cell's patch probabilities draw the other samples."""

    bsdf_fraction: np.float32
    patch_rows: int
    patch_columns: int
    cells: Cells
    cdf: np.ndarray  # (C, N) float32, cumulative probability of the patches of each cell; the last is 1


def one_cell(bsdf_fraction: float) -> Directions:
    """Directions that are the same everywhere: one cell with one patch, the whole hemisphere."""
    cells = Cells(np.zeros(3, np.float32), F(0), np.zeros(1, np.uint64), np.zeros(1, np.int32))
    return Directions(F(bsdf_fraction), 1, 1, cells, np.ones((1, 1), np.float32))


@part
def cell_key(cells, position, normal):
    """The key of a state's cell, a non-zero number. The position may lie outside the grid."""
    key = np.uint64(1)
    for axis in range(3):
        step = np.int64(np.floor((position[axis] - cells.origin[axis]) * cells.per_metre))
        key = (key << np.uint64(16)) | np.uint64(step & 0xFFFF)
    turn = np.int64(0)
    for axis in range(3):
        turn = turn * (2 * NORMAL_STEPS + 1) + np.int64(np.floor(normal[axis] * F(NORMAL_STEPS) + F(0.5))) + NORMAL_STEPS
    return (key << np.uint64(8)) ^ np.uint64(turn) | np.uint64(1 << 63)


@part
def find_cell(cells, position, normal):
    """The table's row for a state, or UNKNOWN."""
    if cells.per_metre == F(0):
        return np.int32(0)
    mask = np.uint64(cells.keys.shape[0] - 1)
    key = cell_key(cells, position, normal)
    at = mix(key) & mask
    while cells.keys[at] != np.uint64(0):
        if cells.keys[at] == key:
            return cells.rows[at]
        at = (at + np.uint64(1)) & mask
    return np.int32(UNKNOWN)


@part
def _find(directions, x, n, wo, lobes, count):
    if directions.bsdf_fraction == F(1):
        return F(1), np.int32(UNKNOWN)
    cell = find_cell(directions.cells, x, n)
    return F(1) if cell == UNKNOWN else directions.bsdf_fraction, cell


@part
def _sample(directions, cell, n, wo, u, v, choice):
    patch = pick(directions.cdf, cell, directions.cdf.shape[1], choice)
    t, b = tangents(n)
    return to_world(t, b, n, sample_patch(directions.patch_rows, directions.patch_columns, patch, u, v))


@part
def _pdf(directions, cell, n, wo, wi):
    """p(wi) = P(patch) N / (2 pi), with N patches."""
    t, b = tangents(n)
    local = to_local(t, b, n, wi)
    if local[2] <= F(0):
        return F(0)
    cdf = directions.cdf
    patch = patch_of(directions.patch_rows, directions.patch_columns, local)
    below = cdf[cell, patch - 1] if patch > 0 else F(0)
    return (cdf[cell, patch] - below) * F(cdf.shape[1]) / TWO_PI


declare(Directions, DIFFUSE_REFLECTION, _find, _sample, _pdf)
