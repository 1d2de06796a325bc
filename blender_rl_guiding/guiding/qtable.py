"""Guide `qtable`: a table over cells of position and normal learns the incident radiance by expected SARSA (Dahm and Keller 2017).

Differences from the published method:
1. States. Published: Voronoi cells of points on the surfaces. Here: cells of a hashed grid over position and normal; `cells` = 32 lie
   along the scene's longest side.
2. Time of learning. Published: at each bounce. Here: after each pass, from its transitions in a fixed order: bits do not depend on threads.
3. Cells with few visits (`levels`, `prior`). Published: each cell alone (levels = 1). Here: 5 sizes of cells. The mean of the next larger
   cell counts like prior = 4 visits, because most pairs (state, action) have few visits.
4. Drawing directions (`second_moment`, `weights`, `bsdf_fraction`). Published: in proportion to Q. Here: in proportion to
   sqrt(mean of squared targets) cos(theta), which gives fewer outliers where the radiance varies within a cell and patch (Rath et al.
   2020). A hundredth of the mean is added to each patch. The material draws a share of 0.3.
5. Before anything is learnt. Published: every Q begins at a positive value. Here: the material alone draws directions.
"""

from itertools import pairwise
from typing import Any

import numpy as np

from ..guide_settings import QTable
from ..kernels import kernel
from ..memory import GUESSED, Part
from ..scene.data import SceneData
from .base import OnStep, Transitions, unheard
from .cell_count import cells_found
from .cells import CellTable, cell_size
from .directions import UNKNOWN
from .patch_guide import PatchGuide
from .saved import Arrays, Saved, below

Parents = list[tuple[np.ndarray, int]]
LARGEST = 1e30
LEAST = np.float32(0.01)  # times the mean weight of the patches, added to each: no patch gets probability 0


class QTableGuide(PatchGuide[QTable]):
    """See `Guide`."""

    def __init__(self, settings: QTable, scene: SceneData, seed: int) -> None:
        """Nothing is random: the seed has no effect."""
        size = cell_size(scene, settings.cells)
        self._levels = [CellTable(scene.bounds[0], size * 2**level) for level in range(settings.levels)]
        super().__init__(settings, self._levels[0])
        nothing = np.zeros((0, len(self._cosines)), np.float32)
        # (C, N) float32, for each cell and patch: number of visits, mean target, mean squared target.
        self._visits, self._q, self._squares = nothing, nothing, nothing
        self._arriving = np.zeros(0, np.float32)  # sum_k Q(s, k) cos(theta_k) of each cell, (C,)
        self._estimate = nothing  # (C, N) float32, Q after borrowing from larger cells

    @classmethod
    def memory(cls, settings: QTable, scene: SceneData, visits: float, rough: bool) -> list[Part]:
        cells = visits if rough else cells_found(scene, settings.cells, visits)
        size = cells * (400 + 50 * settings.rows * settings.columns)
        return [Part("table", size, "the guide's cells, rows or columns", GUESSED)]

    def wanted(self) -> int:
        return self._settings.recorded

    def learn(self, transitions: Transitions, on_step: OnStep = unheard) -> dict[str, Any]:
        """Move every Q(s, a) of the pass towards its target, in the order of the transitions."""
        t = transitions
        rows, next_rows = self.cells.insert(t.position, t.normal), self.cells.rows(t.next_position, t.next_normal)
        more = self.cells.count - len(self._q)
        self._visits, self._q, self._squares = (np.pad(a, ((0, more), (0, 0))) for a in (self._visits, self._q, self._squares))
        self._arriving = np.pad(self._arriving, (0, more))
        known = self._visits, self._q, self._squares, self._arriving
        error = expected_sarsa(rows, self._patches(t), t.reward, t.albedo, next_rows, self._cosines, *known)
        if self._q.any():
            self._tabulate(self._parents())
        else:  # the last table has no rows for new cells
            self._forget()
        return {"loss": error / max(1, len(rows)), "cells": self.cells.count}

    def q(self) -> np.ndarray:
        """The estimate of the mean radiance through each patch of each cell, (C, N) float32, as of the last pass that saw light."""
        return self._estimate

    def state(self) -> Arrays:
        levels = [below(f"level-{k}", level.state()) for k, level in enumerate(self._levels)]
        of_levels = {name: array for arrays in levels for name, array in arrays.items()}
        return {"visits": self._visits, "q": self._q, "squares": self._squares} | of_levels

    def restore(self, saved: Saved) -> None:
        """Directions and `_estimate` are not saved: they are computed again."""
        for k, level in enumerate(self._levels):
            level.restore(saved.below(f"level-{k}"))
        shape = self.cells.count, len(self._cosines)
        self._visits, self._q, self._squares = (saved.array(name, np.float32, *shape) for name in ("visits", "q", "squares"))
        self._arriving = np.zeros(len(self._q), np.float32)
        if self._q.any():
            self._tabulate(self._known_parents())

    def _tabulate(self, parents: Parents) -> None:
        prior = np.float32(self._settings.prior)
        self._estimate = borrowed(self._q, self._visits, parents, prior)
        # A matrix product's rounding may depend on the machine's threads.
        self._arriving = np.einsum("ck,k->c", self._estimate, self._cosines)
        weights = np.sqrt(borrowed(self._squares, self._visits, parents, prior)) if self._settings.second_moment else self._estimate
        weights = np.nan_to_num(weights, nan=0.0, posinf=LARGEST)  # where the radiance's square overflows single precision
        weights[~weights.any(axis=1)] = 1
        weights = weights + LEAST * weights.mean(axis=1, keepdims=True)
        self._lay_out(weights)

    def _known_parents(self) -> Parents:
        """`_parents` of the cells that exist; inserts none. ValueError if a cell has no parent."""
        parents = [(coarse.rows(*fine.states()), coarse.count) for fine, coarse in pairwise(self._levels)]
        if any((rows == UNKNOWN).any() for rows, _ in parents):
            raise ValueError("a cell lies in no larger one")
        return parents

    def _parents(self) -> Parents:
        """For each level but the last: the row of every cell's parent in the next one, and how many parents there are."""
        parents = []
        for fine, coarse in pairwise(self._levels):
            states = fine.states()
            parents.append((coarse.insert(*states), coarse.count))
        return parents


def borrowed(means: np.ndarray, visits: np.ndarray, parents: Parents, prior: np.float32) -> np.ndarray:
    """(C, N): (visits * mean + prior * parent) / (visits + prior). `parent` is the parent cell's result of the same formula.

    The parent of the largest cells is the mean over all visits. visits: (C, N), visits of each mean. parents: for each level but the
    last, the row of each cell's parent in the next level, and the number of parents.
    """
    sums, seen = [means * visits], [visits]
    for rows, count in parents:
        sums.append(added(sums[-1], rows, count))
        seen.append(added(seen[-1], rows, count))
    above = np.full_like(sums[-1], sums[-1].sum() / seen[-1].sum())
    for (rows, _), total, count in zip(reversed(parents), reversed(sums[1:]), reversed(seen[1:]), strict=True):
        above = ((total + prior * above) / (count + prior))[rows]
    return (sums[0] + prior * above) / (seen[0] + prior)


def added(values: np.ndarray, rows: np.ndarray, count: int) -> np.ndarray:
    """(count, N) float32: row r is the sum of all values[i], (n, N), with rows[i] = r."""
    total = np.zeros((count, values.shape[1]), np.float32)
    add_rows(values, rows, total)
    return total


@kernel
def add_rows(values, rows, total):
    """total[rows[i]] += values[i] for every i."""
    for i in range(rows.shape[0]):
        for k in range(values.shape[1]):
            total[rows[i], k] += values[i, k]


@kernel
def expected_sarsa(rows, patches, reward, albedo, next_rows, cosines, visits, q, squares, arriving):
    """Q(s, a) <- Q(s, a) + (target - Q(s, a)) / (1 + earlier visits), one transition after another; returns the sum of squared errors.

    target = r + (2 pi / N) sum_k Q(s', k) albedo / pi cos(theta_k), cos(theta_k) its exact mean over patch k. `arriving` is updated, too.
    """
    total = 0.0
    per_patch = np.float32(2.0 / cosines.shape[0])
    for i in range(rows.shape[0]):
        s, a = rows[i], patches[i]
        target = reward[i]
        if next_rows[i] != UNKNOWN:
            target += albedo[i] * per_patch * arriving[next_rows[i]]
        visits[s, a] += np.float32(1)
        error = target - q[s, a]
        change = error / visits[s, a]
        q[s, a] += change
        squares[s, a] += (target * target - squares[s, a]) / visits[s, a]
        arriving[s] += change * cosines[a]
        total += error * error
    return total


GUIDE = QTableGuide
