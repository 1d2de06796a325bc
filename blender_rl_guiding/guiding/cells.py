"""The cells of the guiding table: a hash table over position and normal. A cell exists once a transition has fallen into it."""

import numpy as np

from ..kernels import kernel, part
from ..kernels.bits import mix
from ..kernels.sampling import F, vector
from ..scene.data import SceneData
from .directions import UNKNOWN, Cells, cell_key, find_cell
from .saved import Arrays, Saved

_LEAST = 1e-30  # metres, lower bound of a scene's longest side: cells per metre stay finite


def cell_size(scene: SceneData, cells: int) -> float:
    """The side of a cell, metres: the scene's longest side / `cells`."""
    low, high = scene.bounds
    return max(float((high - low).max()), _LEAST) / cells


MOST_STEPS = 1000  # from the first place that a key's hash names; random keys are up to 9 steps away in a table of a million


class CellTable:
    """A hash table of cells; it grows with the states inserted. A cell is the mean of its states, so it lies on the surface."""

    def __init__(self, low: np.ndarray, cell: float) -> None:
        """low: (3,), the scene's lowest corner, metres. The grid begins half a cell below it, so that walls at `low` lie inside cells."""
        origin = (low - 0.5 * cell).astype(np.float32)
        self.cells = Cells(origin, F(1 / cell), np.zeros(1024, np.uint64), np.zeros(1024, np.int32))
        self._sums = np.zeros((512, 7))  # of each cell: sum of positions, sum of normals, count
        self.count = 0

    def insert(self, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Add states, (n, 3) float32 each, in their order; returns the row of each, (n,) int32."""
        rows, done = np.empty(len(position), np.int32), 0
        while done < len(position):
            done, self.count = insert_states(self.cells, position, normal, done, self._sums, self.count, rows)
            if done < len(position):
                self._grow()
        return rows

    def rows(self, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """The row of each state, (n,) int32; UNKNOWN where none was inserted."""
        found = np.empty(len(position), np.int32)
        find_rows(self.cells, position, normal, found)
        return found

    def states(self) -> tuple[np.ndarray, np.ndarray]:
        """Mean position and unit mean normal of each cell, (C, 3) float32 each."""
        sums = self._sums[: self.count]
        normal = sums[:, 3:6] / np.linalg.norm(sums[:, 3:6], axis=1, keepdims=True)
        return (sums[:, :3] / sums[:, 6:]).astype(np.float32), normal.astype(np.float32)

    def state(self) -> Arrays:
        """The cells in the order of their rows: keys, and sums of the states seen in each."""
        used = self.cells.keys != 0
        keys = np.empty(self.count, np.uint64)
        keys[self.cells.rows[used]] = self.cells.keys[used]
        return {"keys": keys, "sums": self._sums[: self.count]}

    def restore(self, saved: Saved) -> None:
        """Take a saved `state`. Each key goes into an empty table, so every row in the table exists, whatever the file says.

        ValueError if keys are equal or empty, or collide far more often than random keys.
        """
        keys = saved.array("keys", np.uint64, None)
        sums = saved.array("sums", np.float64, len(keys), 7)
        if not (keys >> np.uint64(63)).all() or len(np.unique(keys)) < len(keys):
            raise ValueError("two cells have one key, or one has none")
        room = len(self._sums)
        while room < len(keys):
            room *= 2
        self.cells, self._sums = self._empty(2 * room), np.zeros((room, 7))
        if not put_all(self.cells, keys):
            raise ValueError("the cells crowd in one place of their table")
        self._sums[: len(keys)], self.count = sums, len(keys)

    def _grow(self) -> None:
        old, self.cells = self.cells, self._empty(2 * len(self.cells.keys))
        rehash(old, self.cells)
        self._sums = np.concatenate([self._sums, np.zeros_like(self._sums)])

    def _empty(self, size: int) -> Cells:
        return Cells(self.cells.origin, self.cells.per_metre, np.zeros(size, np.uint64), np.zeros(size, np.int32))


@kernel
def insert_states(cells, position, normal, start, sums, count, rows):
    """Insert states from `start` on, until all are inserted or the table is full. Returns (first state not inserted, number of cells).

    Writes the row of each state to `rows`, (n,) int32.
    """
    for i in range(start, position.shape[0]):
        x, n = vector(position, i), vector(normal, i)
        row = find_cell(cells, x, n)
        if row == UNKNOWN:
            if count == sums.shape[0]:
                return i, count
            row = np.int32(count)
            put(cells, cell_key(cells, x, n), row)
            count += 1
        for axis in range(3):
            sums[row, axis] += x[axis]
            sums[row, 3 + axis] += n[axis]
        sums[row, 6] += 1.0
        rows[i] = row
    return position.shape[0], count


@part
def put(cells, key, row):
    """Store a key that is not in the table."""
    mask = np.uint64(cells.keys.shape[0] - 1)
    at = mix(key) & mask
    while cells.keys[at] != np.uint64(0):
        at = (at + np.uint64(1)) & mask
    cells.keys[at] = key
    cells.rows[at] = row


@kernel
def put_all(cells, keys):
    """Store keys, (n,) uint64, all different and not in the table. The row of keys[i] is i.

    Returns False if a key is not `is_near`. Random keys always are; other keys were chosen to make look-ups slow.
    """
    for row in range(keys.shape[0]):
        put(cells, keys[row], np.int32(row))
        if not is_near(cells, keys[row]):
            return False
    return True


@part
def is_near(cells, key):
    """Whether a search finds a key within `MOST_STEPS` steps."""
    mask = np.uint64(cells.keys.shape[0] - 1)
    first = mix(key)
    for step in range(MOST_STEPS):  # noqa: SIM110  # kernels have no generators
        if cells.keys[(first + np.uint64(step)) & mask] == key:
            return True
    return False


@kernel
def rehash(old, new):
    """Copy every key of a table to a larger one."""
    for i in range(old.keys.shape[0]):
        if old.keys[i] != np.uint64(0):
            put(new, old.keys[i], old.rows[i])


@kernel
def find_rows(cells, position, normal, rows):
    """Write the row of each state to `rows`, (n,) int32."""
    for i in range(position.shape[0]):
        rows[i] = find_cell(cells, vector(position, i), vector(normal, i))
