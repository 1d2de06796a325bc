"""The table of points for stratified numbers: Sobol's first two dimensions with Owen's scrambling (1995).

The points are a (0, 2)-sequence in base 2: in each aligned group of 2^k points, every elementary interval of area 2^-k has one point. Xor
with a constant keeps this property. A permutation that keeps aligned blocks together (`bits.shuffled`) keeps it, too. So all pixels and
dimensions use the same table (after Burley 2020).
"""

import numpy as np

from .bits import half_mix, mix_rest

LEVELS = 10  # a block has 2^LEVELS points of 8 bytes: it fits the processor's L1 cache
_SEED = 24  # best of 150: smallest errors of integrals over the plane; dimensions correlate no more than in random orders


def _sobol(levels: int) -> tuple[np.ndarray, np.ndarray]:
    """Both coordinates of 2^levels points as 32-bit fractions, (n,) uint64 each, sorted by the first coordinate.

    Sample i is at the place that has i's bits in reversed order.
    """
    first = np.arange(1 << levels, dtype=np.uint64) << np.uint64(32 - levels)
    second = first
    # Second dimension: multiply by Pascal's triangle modulo 2 (row b: the binomial coefficients of b), in five steps.
    for shift, kept in ((16, 0x0000FFFF), (8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
        second = second ^ ((second & np.uint64(kept)) << np.uint64(shift))
    return first, second


def _owen(x: np.ndarray, seed: int) -> np.ndarray:
    """Owen's scrambling of 32-bit fractions: a hash of all higher bits flips each bit."""
    flips = np.zeros_like(x)
    for bit in range(32):
        above = x >> np.uint64(32 - bit)
        flips |= (_hash(above + np.uint64(bit << 40) + np.uint64(seed << 48)) >> np.uint64(63)) << np.uint64(31 - bit)
    return x ^ flips


def _hash(z: np.ndarray) -> np.ndarray:
    return mix_rest.py_func(half_mix.py_func(z))


def _points() -> np.ndarray:
    """(2^LEVELS,) uint64: each number is a point, with the first coordinate in the upper 32 bits. Point 0 is 0, the identity of xor."""
    x, y = (_owen(coordinate, _SEED + k) for k, coordinate in enumerate(_sobol(LEVELS)))
    both = (x << np.uint64(32)) | y
    return both ^ both[0]


POINTS = _points()
