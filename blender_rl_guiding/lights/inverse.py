"""Draws from a discrete distribution by inverting its cumulative probabilities.

The inverse is monotone, so stratified numbers stay stratified.
"""

from typing import NamedTuple

import numpy as np

from ..kernels import part


class Inverse(NamedTuple):
    """n entries. For u a search begins at first[floor(u n)], so its mean length does not depend on n (Chen and Asau 1974)."""

    cdf: np.ndarray  # (n,) float64, cumulative probabilities; the last is 1
    first: np.ndarray  # (n,) int32, first[k] = min {i: cdf[i] > k / n}


def inverse_table(weights: np.ndarray) -> Inverse:
    """The table for `weights`, (n,) float64, finite, none negative, not all zero. cdf[n - 1] = 1, so every `draw` ends."""
    cdf = weights.cumsum()
    cdf /= cdf[-1]
    return Inverse(cdf, np.searchsorted(cdf, np.arange(len(cdf)) / len(cdf), side="right").astype(np.int32))


@part
def draw(table, u):
    """(i, (u - cdf[i-1]) / (cdf[i] - cdf[i-1])) with the first i where cdf[i] > u, for u in [0, 1), float64."""
    n = table.cdf.shape[0]
    i = np.int64(table.first[np.int64(u * n)])
    while table.cdf[i] <= u:
        i += 1
    below = table.cdf[i - 1] if i > 0 else 0.0
    return i, (u - below) / (table.cdf[i] - below)
