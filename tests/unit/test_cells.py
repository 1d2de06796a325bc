"""Cells of the guiding table: a state in an inserted cell is found, for all sizes of the table; other states are unknown."""

import numpy as np
import pytest

from blender_rl_guiding.guiding.cells import CellTable
from blender_rl_guiding.guiding.directions import UNKNOWN, Cells, find_cell, one_cell
from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.kernels.sampling import vector

UP = np.array([0, 0, 1], np.float32)


def table(cell: float = 1.0) -> CellTable:
    return CellTable(np.zeros(3, np.float32), cell)


def insert(cells: CellTable, *states: tuple) -> None:
    positions, normals = (np.array(column, np.float32) for column in zip(*states, strict=True))
    cells.insert(positions, normals)


@kernel
def find_cells(cells, positions, normals, found):
    for i in range(len(positions)):
        found[i] = find_cell(cells, vector(positions, i), vector(normals, i))


def rows(cells: Cells, positions, normals=UP) -> list[int]:
    """The table's row for each position (n, 3)."""
    positions = np.array(positions, np.float32)
    normals, found = np.array(np.broadcast_to(normals, positions.shape), np.float32), np.empty(len(positions), np.int64)
    find_cells(cells, positions, normals, found)
    return found.tolist()


def test_states_of_one_cell_share_a_row_and_leave_their_mean():
    cells = table()
    insert(cells, ((0.1, 0.2, 0.3), UP), ((0.3, 0.4, -0.3), (0.1, 0, 0.995)), ((0.9, 0, 0), UP), ((0.1, 0.2, 0.3), -UP))
    assert cells.count == 3
    assert rows(cells.cells, [(0.4, 0.4, 0.4), (1.0, 0, 0), (0, 0, 0)], [UP, UP, -UP]) == [0, 1, 2]
    positions, normals = cells.states()
    np.testing.assert_allclose(positions, [(0.2, 0.3, 0), (0.9, 0, 0), (0.1, 0.2, 0.3)], atol=1e-6)
    np.testing.assert_allclose(normals, [np.array([0.05, 0, 0.9975]) / np.hypot(0.05, 0.9975), UP, -UP], atol=1e-6)
    assert positions.dtype == normals.dtype == np.float32


def test_what_was_never_seen_is_unknown():
    cells = table()
    assert rows(cells.cells, [(0, 0, 0)]) == [UNKNOWN]
    insert(cells, ((0, 0, 0), UP))
    assert rows(cells.cells, [(2, 0, 0), (0, 0, 0), (0, 0, -1)], [UP, (1, 0, 0), UP]) == [UNKNOWN] * 3


def test_walls_on_the_bounds_and_axis_aligned_normals_lie_inside_cells():
    """Rounding does not spread the points of a wall over two layers of cells."""
    cells = table(0.25)
    rng = np.random.default_rng(1)
    for wall in range(3):
        for side in (0.0, 3.0):
            positions = rng.random((500, 3)).astype(np.float32) * 3
            positions[:, wall] = side + rng.normal(size=500) * 1e-6
            normals = np.roll(UP, wall + 1) + rng.normal(size=(500, 3)).astype(np.float32) * 1e-6
            before = cells.count
            cells.insert(positions, normals.astype(np.float32))
            assert cells.count - before <= 13 * 13


def test_negative_coordinates_and_neighbours_are_told_apart():
    cells, grid = table(), [(x, y, z) for x in range(-3, 3) for y in range(-3, 3) for z in range(-3, 3)]
    insert(cells, *((p, UP) for p in grid))
    assert cells.count == len(grid)
    assert rows(cells.cells, grid) == list(range(len(grid)))


def test_a_growing_table_keeps_every_row():
    cells, rng = table(), np.random.default_rng(2)
    grid = np.stack(np.meshgrid(*[np.arange(20)] * 3), axis=-1).reshape(-1, 3).astype(np.float32)
    normals = np.broadcast_to(UP, grid.shape).copy()
    order = rng.permutation(len(grid))
    for part in np.array_split(order, 7):
        cells.insert(grid[part], normals[part])
    assert cells.count == 8000
    assert len(cells.cells.keys) == 16384
    assert rows(cells.cells, grid[order]) == list(range(8000))
    np.testing.assert_allclose(cells.states()[0], grid[order])
    cells.insert(grid, normals)
    assert cells.count == 8000


def test_order_of_rows_is_the_order_of_arrival_however_it_is_cut():
    states = np.random.default_rng(3).normal(size=(5000, 3)).astype(np.float32) * 9
    normals = np.broadcast_to(UP, states.shape).copy()
    whole, parts = table(), table()
    whole.insert(states, normals)
    for part in np.array_split(states, 9):
        parts.insert(part, normals[: len(part)])
    np.testing.assert_array_equal(whole.states()[0], parts.states()[0])


@pytest.mark.parametrize("bsdf_fraction", [0.0, 1.0])
def test_one_cell_holds_everything(bsdf_fraction):
    assert rows(one_cell(bsdf_fraction).cells, [(-5, 7, 1e9)]) == [0]
