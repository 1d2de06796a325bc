"""Walker's alias method: drawing from a discrete distribution in constant time, whatever its size."""

from typing import NamedTuple

import numpy as np

from ..kernels import kernel, part
from ..kernels.sampling import F


class Alias(NamedTuple):
    """n equal columns, each shared by its own entry and another one."""

    threshold: np.ndarray  # (n,) float32, share of the column that is its own entry's
    other: np.ndarray  # (n,) int32


def alias_table(weights: np.ndarray) -> Alias:
    """The table for weights that are not negative and not all zero, (n,) float64 (Vose 1991)."""
    threshold = weights * (len(weights) / weights.sum())
    other = np.arange(len(weights), dtype=np.int32)
    fill(threshold, other, np.empty_like(other), np.empty_like(other))
    return Alias(threshold.astype(np.float32), other)


@kernel
def fill(threshold, other, low, high):
    """Give every column that is too low the rest of one that is too high; `threshold` has a mean of 1. `low` and `high` are memory."""
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
    for i in range(lows):  # what rounding has left
        threshold[low[i]] = 1.0
    for i in range(highs):
        threshold[high[i]] = 1.0


@part
def draw(alias, u, v):
    """An entry with its probability, by two uniform numbers, and v in [0, 1) rescaled to be used again.

    What is left of u within its column would not do for v: among a million columns it has but 4 of its 24 bits.
    """
    n = alias.threshold.shape[0]
    i = min(np.int32(u * F(n)), np.int32(n - 1))
    threshold = alias.threshold[i]
    if v < threshold:
        return np.int64(i), v / threshold
    return np.int64(alias.other[i]), (v - threshold) / (F(1) - threshold)
