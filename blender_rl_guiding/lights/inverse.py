"""Drawing from a discrete distribution by the inverse of its cumulative probabilities: monotone, so that stratified numbers stay so."""

from typing import NamedTuple

import numpy as np

from ..kernels import part


class Inverse(NamedTuple):
    """n entries, and where to begin to look for them, which makes looking as quick however many there are (Chen and Asau 1974)."""

    cdf: np.ndarray  # (n,) float64, cumulative probabilities; the last is 1
    first: np.ndarray  # (n,) int32, the first entry whose cumulative probability exceeds k / n


def inverse_table(weights: np.ndarray) -> Inverse:
    """The table for finite weights that are not negative and not all zero, (n,) float64. By its last entry, 1, every `draw` ends."""
    cdf = weights.cumsum()
    cdf /= cdf[-1]
    return Inverse(cdf, np.searchsorted(cdf, np.arange(len(cdf)) / len(cdf), side="right").astype(np.int32))


@part
def draw(table, u):
    """The first entry whose cumulative probability exceeds u in [0, 1), float64; and the place of u within its share, in [0, 1)."""
    n = table.cdf.shape[0]
    i = np.int64(table.first[np.int64(u * n)])
    while table.cdf[i] <= u:
        i += 1
    below = table.cdf[i - 1] if i > 0 else 0.0
    return i, (u - below) / (table.cdf[i] - below)
