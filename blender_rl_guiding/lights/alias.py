"""Walker's alias method: draws from a discrete distribution in constant time, whatever its size."""

from typing import NamedTuple

import numpy as np

from ..kernels import kernel, part
from ..kernels.sampling import F


class Alias(NamedTuple):
    """n columns of equal width. Column i is shared by entry i and entry other[i]."""

    threshold: np.ndarray  # (n,) float32, share of column i that belongs to entry i
    other: np.ndarray  # (n,) int32, the entry that owns the rest of column i


def alias_table(weights: np.ndarray) -> Alias:
    """The table for `weights`, (n,) float64, none negative, not all zero (Vose 1991)."""
    threshold = weights * (len(weights) / weights.sum())
    other = np.arange(len(weights), dtype=np.int32)
    fill(threshold, other, np.empty_like(other), np.empty_like(other))
    return Alias(threshold.astype(np.float32), other)


@kernel
def fill(threshold, other, low, high):
    """Fill each column below 1 with the excess of a column above 1. Writes to `threshold` and `other`.

    threshold: (n,) float64, n times the probabilities; other: (n,) int32, other[i] = i; low, high: (n,) int32, scratch memory.
    """
    n = threshold.shape[0]
    lows, highs = 0, 0
    for i in range(n):
        if threshold[i] < 1.0:
            low[lows] = i
            lows += 1
        else:
            high[highs] = i
            highs += 1
    while lows > 0 and highs > 0:
        lows -= 1
        poor, rich = low[lows], high[highs - 1]
        other[poor] = rich
        threshold[rich] -= 1.0 - threshold[poor]
        if threshold[rich] < 1.0:
            highs -= 1
            low[lows] = rich
            lows += 1
    for i in range(lows):  # these differ from 1 only by rounding
        threshold[low[i]] = 1.0
    for i in range(highs):
        threshold[high[i]] = 1.0


@part
def draw(alias, u, v):
    """Draw entry i with its probability; u and v are uniform in [0, 1). Returns (i, v rescaled to be uniform again).

    u alone is not enough: with a million columns, its position within a column has only 4 of its 24 bits.
    """
    n = alias.threshold.shape[0]
    i = min(np.int32(u * F(n)), np.int32(n - 1))
    threshold = alias.threshold[i]
    if v < threshold:
        return np.int64(i), v / threshold
    return np.int64(alias.other[i]), (v - threshold) / (F(1) - threshold)
