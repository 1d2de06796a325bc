"""Vectors, tangent frames, warps and keyed random streams, as small kernels in single precision.

A vector is a tuple of three float32. Local frames have the normal along +z.
"""

import math
from typing import NamedTuple

import numpy as np

from . import part
from .bits import half_mix, mix, mix_rest, reversed_bits, shuffled, spread
from .sobol import LEVELS, POINTS

F = np.float32
PI = F(math.pi)
TWO_PI = F(2 * math.pi)
INV_PI = F(1 / math.pi)
LUMINANCE = (0.2126, 0.7152, 0.0722)  # weights of linear Rec. 709 RGB

# --- vectors ---------------------------------------------------------------------------------------------------------


@part
def vector(array, i):
    """Row i of an (n, 3) array."""
    return array[i, 0], array[i, 1], array[i, 2]


@part
def store(array, i, v):
    """Write v to row i of an (n, 3) array."""
    array[i, 0] = v[0]
    array[i, 1] = v[1]
    array[i, 2] = v[2]


@part
def accumulate(array, i, v):
    """Add v to row i of an (n, 3) array."""
    array[i, 0] += v[0]
    array[i, 1] += v[1]
    array[i, 2] += v[2]


@part
def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@part
def cross(a, b):
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@part
def add(a, b):
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@part
def subtract(a, b):
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@part
def multiply(a, b):
    """a b by components, as for colours."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


@part
def scale(a, s):
    """s a."""
    return a[0] * s, a[1] * s, a[2] * s


@part
def normalize(a):
    """The unit vector along a; NaN for the zero vector."""
    return scale(a, F(1) / math.sqrt(dot(a, a)))


@part
def luminance(c):
    """Luminance of linear Rec. 709 RGB."""
    return F(LUMINANCE[0]) * c[0] + F(LUMINANCE[1]) * c[1] + F(LUMINANCE[2]) * c[2]


# --- tangent frames --------------------------------------------------------------------------------------------------


@part
def tangents(n):
    """Two unit vectors that make a right-handed frame with the unit normal n (Duff et al. 2017).

    The published frame jumps at n.z = 0, where all vertical walls are: rounding would turn the frame between two triangles of a wall.
    This frame jumps at n.z = -0.8, still 0.2 away from the pole of the division.
    """
    sign = F(1) if n[2] > F(-0.8) else F(-1)
    a = F(-1) / (sign + n[2])
    b = n[0] * n[1] * a
    return (F(1) + sign * n[0] * n[0] * a, sign * b, -sign * n[0]), (b, sign + n[1] * n[1] * a, -n[1])


@part
def to_world(tangent, bitangent, n, v):
    """v.x tangent + v.y bitangent + v.z n: from the local frame to world space."""
    return add(add(scale(tangent, v[0]), scale(bitangent, v[1])), scale(n, v[2]))


@part
def to_local(tangent, bitangent, n, v):
    """(v.tangent, v.bitangent, v.n): from world space to the local frame."""
    return dot(tangent, v), dot(bitangent, v), dot(n, v)


# --- warps -----------------------------------------------------------------------------------------------------------


@part
def circle(turn):
    """(cos(2 pi turn), sin(2 pi turn)) for turn in [-1, 1]. The error is below 2e-7. Faster than the math library."""
    quarter = np.floor(F(4) * turn + F(0.5))
    x = (turn - F(0.25) * quarter) * TWO_PI  # at most an eighth of a turn: few terms of the series are enough
    s = x * x
    sine = x + x * s * (F(-1 / 6) + s * (F(1 / 120) + s * (F(-1 / 5040) + s * F(1 / 362880))))
    cosine = F(1) + s * (F(-1 / 2) + s * (F(1 / 24) + s * (F(-1 / 720) + s * F(1 / 40320))))
    if np.int32(quarter) & 1:
        cosine, sine = -sine, cosine
    return (-cosine, -sine) if np.int32(quarter) & 2 else (cosine, sine)


@part
def cosine_hemisphere(u, v):
    """A direction around +z with pdf cos(theta) / pi, from two uniform numbers (Malley's method)."""
    r, (x, y) = math.sqrt(u), circle(v)
    return r * x, r * y, math.sqrt(F(1) - u)


@part
def uniform_triangle(u, v):
    """Barycentric coordinates of vertices 1 and 2, uniform over the triangle's area (Heitz 2019)."""
    if v > u:
        return F(0.5) * u, v - F(0.5) * u
    return u - F(0.5) * v, F(0.5) * v


@part
def place(x, count):
    """An index: floor(x), clamped to 0..count - 1; 0 for NaN."""
    return np.int32(min(x, F(count - 1))) if x > F(0) else np.int32(0)


@part
def pick(cdf, row, count, u):
    """min {i < count: cdf[row, i] > u}, for u in [0, 1)."""
    low, high = 0, count - 1
    while low < high:
        middle = (low + high) >> 1
        if cdf[row, middle] > u:
            high = middle
        else:
            low = middle + 1
    return low


# --- random streams --------------------------------------------------------------------------------------------------

BLOCK = 1 << LEVELS  # samples of a pixel that are stratified together
GOLDEN = np.uint64(0x9E3779B97F4A7C15)  # 2^64 / golden ratio


class Stream(NamedTuple):
    """The key of one path's random numbers."""

    bits: np.uint64  # hash of seed, pixel and block; a block has BLOCK samples if stratified, one sample if independent
    place: np.uint32  # the sample's index in its block, with reversed bits, after `spread`
    mask: np.uint32  # all ones if stratified, 0 if independent


@part
def stream(seed, pixel, sample, stratified):
    """The key of one path's random numbers; another seed, pixel or sample gives another key."""
    key = mix(np.uint64(seed) + GOLDEN) + (np.uint64(pixel) << np.uint64(32))
    if stratified:
        block, index = np.uint64(sample) // np.uint64(BLOCK), np.uint32(sample % BLOCK)
        return Stream(mix(key + block), spread(reversed_bits(index)), np.uint32(0xFFFFFFFF))
    return Stream(mix(key + np.uint64(sample)), np.uint32(0), np.uint32(0))


@part
def uniform2(key, dimension):
    """Two numbers in [0, 1), multiples of 2^-24. They depend only on the stream's key and the dimension.

    Independent: 48 bits of the hash of seed, pixel, sample and dimension. Stratified: a point of `POINTS`, xor the hash of seed, pixel,
    block and dimension; the hash also permutes the points. In each aligned group of 2^k samples of a block, every elementary interval
    of area 2^-k then has one sample.
    """
    half = half_mix(key.bits + np.uint64(dimension + 1) * GOLDEN)
    place = shuffled(key.place, np.uint32(half >> np.uint64(32))) & key.mask
    bits = mix_rest(half) ^ POINTS[place >> np.uint32(32 - LEVELS)]
    return F(np.uint32(bits >> np.uint64(40))) * F(2**-24), F(np.uint32(bits >> np.uint64(8)) & np.uint32(0xFFFFFF)) * F(2**-24)


@part
def finer(u, v):
    """u + 2^-24 v, float64: one number in [0, 1) with 48 bits, enough to pick one of a million emitters. It is monotone in u."""
    return np.float64(u) + np.float64(v) * 2.0**-24
