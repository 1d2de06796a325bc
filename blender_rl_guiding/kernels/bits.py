"""Hashes and permutations of bits, as small kernels."""

import numpy as np

from . import part


@part
def mix(z):
    """The finaliser of SplitMix64 (Steele et al. 2014)."""
    return mix_rest(half_mix(z))


@part
def half_mix(z):
    """The first half of `mix`."""
    return (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)


@part
def mix_rest(z):
    """The second half of `mix`."""
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@part
def reversed_bits(x):
    """32 bits in the opposite order."""
    x = np.uint32((x >> np.uint32(16)) | (x << np.uint32(16)))
    x = np.uint32(((x >> np.uint32(8)) & np.uint32(0x00FF00FF)) | ((x & np.uint32(0x00FF00FF)) << np.uint32(8)))
    x = np.uint32(((x >> np.uint32(4)) & np.uint32(0x0F0F0F0F)) | ((x & np.uint32(0x0F0F0F0F)) << np.uint32(4)))
    x = np.uint32(((x >> np.uint32(2)) & np.uint32(0x33333333)) | ((x & np.uint32(0x33333333)) << np.uint32(2)))
    return np.uint32(((x >> np.uint32(1)) & np.uint32(0x55555555)) | ((x & np.uint32(0x55555555)) << np.uint32(1)))


@part
def spread(place):
    """The first half of the hash of `place`; `shuffled` is the second half. This half does not depend on the seed."""
    return np.uint32(place ^ place * np.uint32(0x3D20ADEA))


@part
def shuffled(place, seed):
    """The second half of the hash of `place`, the result of `spread`. Bit k depends only on the seed and on bits 0..k.

    For indices with reversed bits, the hash is a permutation that keeps each aligned block of 2^k indices together (Laine, Karras 2011).
    """
    place = np.uint32((place + seed) * ((seed >> np.uint32(16)) | np.uint32(1)))
    place = np.uint32(place ^ place * np.uint32(0x05526C56))
    return np.uint32(place ^ place * np.uint32(0x53A22864))
