"""How diffuse reflection chooses its direction: the material's own sampling mixed with a table of patch probabilities.

Every guide hands the tracer one `Directions`, frozen while a pass renders, so that the tracer has one kernel for all guides.
The table has a row for each cell of a hashed grid over position and normal; where a cell is unknown the material alone decides.
Lobes that are not diffuse reflection keep their own sampling: a product with them would have to be formed at the vertex.
"""

from typing import NamedTuple

import numpy as np

from ..kernels import part
from ..kernels.bits import mix
from ..kernels.sampling import TWO_PI, F, pick
from .patches import patch_of, sample_patch

NORMAL_STEPS = 2  # a normal's components are rounded to halves, so that no axis-aligned normal lies on a boundary
UNKNOWN = -1


class Cells(NamedTuple):
    """An open-addressed hash table from grid cells to rows. Its size is a power of two, at least twice the rows."""

    origin: np.ndarray  # (3,) float32
    per_metre: np.float32  # cells per metre; 0 makes one cell of everything
    keys: np.ndarray  # (H,) uint64, 0 where free
    rows: np.ndarray  # (H,) int32


class Directions(NamedTuple):
    """A mixture, for diffuse lobes, of the material's pdf (share `bsdf_fraction`) and the cell's patch probabilities."""

    bsdf_fraction: np.float32
    patch_rows: int
    patch_columns: int
    cells: Cells
    cdf: np.ndarray  # (C, N) float32, cumulative probability of the patches of each cell; the last is 1


def one_cell(bsdf_fraction: float) -> Directions:
    """Directions that are the same everywhere: one patch, all of the hemisphere."""
    cells = Cells(np.zeros(3, np.float32), F(0), np.zeros(1, np.uint64), np.zeros(1, np.int32))
    return Directions(F(bsdf_fraction), 1, 1, cells, np.ones((1, 1), np.float32))


@part
def cell_key(cells, position, normal):
    """The cell of a state as one non-zero number; position may lie outside the grid."""
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
def sample_table(directions, row, u, v, choice):
    """Draw a local direction wi from the patches of a cell, by three uniform numbers."""
    patch = pick(directions.cdf, row, directions.cdf.shape[1], choice)
    return sample_patch(directions.patch_rows, directions.patch_columns, patch, u, v)


@part
def table_pdf(directions, row, wi):
    """Density of `sample_table` per solid angle: P(patch) N / (2 pi)."""
    if wi[2] <= F(0):
        return F(0)
    cdf = directions.cdf
    patch = patch_of(directions.patch_rows, directions.patch_columns, wi)
    below = cdf[row, patch - 1] if patch > 0 else F(0)
    return (cdf[row, patch] - below) * F(cdf.shape[1]) / TWO_PI
