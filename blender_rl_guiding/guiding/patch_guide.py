"""The common part of `qtable` and `dqn`: an estimate Q of incident radiance over cells and patches, and a table of probabilities."""

from typing import Generic, TypeVar

import numpy as np

from ..guide_settings import DQN, QTable
from .base import Guide, Learnt, Transitions
from .cells import CellTable
from .directions import UNKNOWN, Directions, one_cell
from .patches import mean_cosines, patches_of

S = TypeVar("S", QTable, DQN)


class PatchGuide(Guide, Generic[S]):
    """A guide that draws patches by a table of probabilities. Before the first table exists, the material draws all directions."""

    def __init__(self, settings: S, cells: CellTable) -> None:
        self._settings, self.cells = settings, cells
        self._grid = settings.rows, settings.columns
        self._cosines = mean_cosines(*self._grid)
        self._forget()

    def q(self) -> np.ndarray:
        """The estimate of the mean radiance through each patch of each cell, (C, N) float32."""
        raise NotImplementedError

    def directions(self) -> Directions:
        return self._directions

    def states(self, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        return self.cells.rows(position, normal)

    def learnt(self, position: np.ndarray, normal: np.ndarray) -> Learnt | None:
        row = int(self.states(position[None], normal[None])[0])
        if row == UNKNOWN or not self._taught:
            return None
        chances = np.diff(self._directions.cdf[row], prepend=np.float32(0))
        return Learnt(self.q()[row].reshape(self._grid), chances.reshape(self._grid))

    def _patches(self, t: Transitions) -> np.ndarray:
        """The patch that the direction of each transition passes through, (n,) int64."""
        patches = np.empty(len(t.reward), np.int64)
        patches_of(*self._grid, t.normal, t.direction, patches)
        return patches

    def _forget(self) -> None:
        """Drop the table. Then the material draws all directions."""
        self._directions, self._taught = one_cell(bsdf_fraction=1.0), False

    def _lay_out(self, weights: np.ndarray) -> None:
        """Make the table from weights (C, N) of each cell and patch. The setting "product" multiplies them by the mean cosine."""
        s = self._settings
        if s.weights == "product":
            weights = weights * self._cosines
        cdf = weights.cumsum(axis=1, dtype=np.float64)
        cdf = (cdf / cdf[:, -1:]).astype(np.float32)
        self._directions, self._taught = Directions(np.float32(s.bsdf_fraction), *self._grid, self.cells.cells, cdf), True
