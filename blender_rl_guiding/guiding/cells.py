"""The cells of the guiding table: found where transitions were, hashed over position and normal."""

import numpy as np

from ..kernels import kernel, part
from ..kernels.bits import mix
from ..kernels.sampling import F, vector
from ..scene.data import SceneData
from .directions import UNKNOWN, Cells, cell_key, find_cell
from .saved import Arrays, Saved

_LEAST = 1e-30  # metres of a scene's longest side, so that there are no infinitely many cells to a metre


def cell_size(scene: SceneData, cells: int) -> float:
    """Metres along a side of a cell, of which so many lie along the scene's longest side."""
    low, high = scene.bounds
    return max(float((high - low).max()), _LEAST) / cells


MOST_STEPS = 1000  # from a key's place to where it is; 9 in a table of a million keys by chance


class CellTable:
    """Grows as states are seen. Each cell stands for the mean of the states seen in it, so that it lies on the surface."""

    def __init__(self, low: np.ndarray, cell: float) -> None:
        """`low` is the lowest corner of the scene; half a cell is added below, so that walls on it lie inside cells."""
        origin = (low - 0.5 * cell).astype(np.float32)
        self.cells = Cells(origin, F(1 / cell), np.zeros(1024, np.uint64), np.zeros(1024, np.int32))
        self._sums = np.zeros((512, 7))  # position, normal, count
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
        """Take up `state`. Each key is put into an empty table, so that every row of it exists whatever the file says."""
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
    """Insert states from `start` on until done or the table is full; returns the first not inserted and the number of cells.

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
    """Store keys, (n,) uint64, that differ and are not in the table; the row of each is its place.

    False where one is further from its place than keys come to be by chance: whoever chose them wants to make looking up slow.
    """
    for row in range(keys.shape[0]):
        put(cells, keys[row], np.int32(row))
        if not is_near(cells, keys[row]):
            return False
    return True


@part
def is_near(cells, key):
    """Whether a key is found within `MOST_STEPS`."""
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
