"""The points that stratified numbers are made from: a block of Sobol's first two dimensions, scrambled as Owen (1995) has it.

A (0, 2)-sequence in base 2: of each aligned 2^k points, every elementary interval of area 2^-k holds one. Neither xor with a constant nor
another order within aligned blocks (as of `bits.shuffled`) changes that: one table serves every pixel and dimension (after Burley 2020).
"""

import numpy as np

from .bits import half_mix, mix_rest

LEVELS = 10  # a block has 2^LEVELS points, 8 bytes each, which stay in the processor's first cache
_SEED = 24  # of 150: dimensions correlate as little as chance orders let them, and integrals of the plane have the least errors


def _sobol(levels: int) -> tuple[np.ndarray, np.ndarray]:
    """Both coordinates of 2^levels points as fractions of 32 bits, (n,) uint64, ordered by the first: of sample i at i's bits reversed."""
    first = np.arange(1 << levels, dtype=np.uint64) << np.uint64(32 - levels)
    second = first
    # Pascal's triangle modulo 2, whose row for bit b is that of the binomial coefficients of b, in five steps.
    for shift, kept in ((16, 0x0000FFFF), (8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
        second = second ^ ((second & np.uint64(kept)) << np.uint64(shift))
    return first, second


def _owen(x: np.ndarray, seed: int) -> np.ndarray:
    """Fractions of 32 bits, each bit flipped by chance that depends on all bits above it."""
    flips = np.zeros_like(x)
    for bit in range(32):
        above = x >> np.uint64(32 - bit)
        flips |= (_hash(above + np.uint64(bit << 40) + np.uint64(seed << 48)) >> np.uint64(63)) << np.uint64(31 - bit)
    return x ^ flips


def _hash(z: np.ndarray) -> np.ndarray:
    return mix_rest.py_func(half_mix.py_func(z))


def _points() -> np.ndarray:
    """(2^LEVELS,) uint64, a point each, its first coordinate above the second; the first is 0, so that xor with it changes nothing."""
    x, y = (_owen(coordinate, _SEED + k) for k, coordinate in enumerate(_sobol(LEVELS)))
    both = (x << np.uint64(32)) | y
    return both ^ both[0]


POINTS = _points()
