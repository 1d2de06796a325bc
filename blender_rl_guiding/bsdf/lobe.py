"""A lobe is one row of float32 in the scratch array. This file names the columns."""

import numpy as np

from ..kernels import part
from ..kernels.sampling import F, dot, luminance, normalize

LOBES, COLUMNS = 65, 32  # shape of the scratch array: Cycles' 64 lobes, and a spare row, so that `write` needs no test for a full array
CUTOFF = F(1e-5)  # lobes with a smaller albedo are left out

# Kinds of lobes.
DIFFUSE, OREN_NAYAR, SHEEN, TRANSLUCENT, GLOSSY, GLASS, REFRACTION = (F(k) for k in range(7))

# Ways to spread light. SINGLE: only in single directions. APART: guides draw no directions. The last two: guides may draw directions.
# APART and the last two are powers of 2, so a sum of them is a set.
SINGLE, APART, DIFFUSE_REFLECTION, ROUGH_REFLECTION = F(0), F(1), F(2), F(4)

# Columns of every lobe; a vector or a colour has three. np.int64, because Numba would compile again for each literal number.
KIND = np.int64(0)
PROBABILITY = np.int64(1)  # probability of picking the lobe
SPREAD = np.int64(2)  # how the lobe spreads light
BUMPED = np.int64(3)  # 1 if the lobe's normal is not the surface's shading normal
NORMAL = np.int64(4)
WEIGHT = np.int64(7)  # factor on the lobe, with its energy compensation
ALBEDO = np.int64(10)  # estimate of the share of light that the lobe scatters, RGB
SMOOTH_NORMAL = np.int64(13)  # the surface's shading normal

# Columns of microfacet lobes. Oren-Nayar and sheen store other numbers in the first of them.
TANGENT = np.int64(16)
ALPHA_X, ALPHA_Y = np.int64(19), np.int64(20)
IOR = np.int64(21)  # (ior on the far side) / (ior on wo's side)
F0 = np.int64(22)
F82 = np.int64(25)  # of metals: the b of `fresnel.f82`
TRANSMISSION_TINT = np.int64(25)  # of glass
REFLECTION_TINT = np.int64(28)  # of glass
FRESNEL = np.int64(31)


@part
def get(lobes, k, column):
    """The vector or colour in three columns of lobe k."""
    return lobes[k, column], lobes[k, column + 1], lobes[k, column + 2]


@part
def put(lobes, k, column, v):
    """Write a vector or colour to three columns of lobe k."""
    lobes[k, column] = v[0]
    lobes[k, column + 1] = v[1]
    lobes[k, column + 2] = v[2]


@part
def write(lobes, k, kind, spread, point, n, weight, albedo):
    """Write the columns that every lobe has. PROBABILITY is the luminance of the albedo; `scatter` normalizes it later."""
    lobes[k, KIND] = kind
    lobes[k, PROBABILITY] = luminance(albedo)
    lobes[k, SPREAD] = spread
    put(lobes, k, NORMAL, n)
    put(lobes, k, WEIGHT, weight)
    put(lobes, k, ALBEDO, albedo)
    bumped = n != point.n
    lobes[k, BUMPED] = F(1) if bumped else F(0)
    if bumped:
        put(lobes, k, SMOOTH_NORMAL, point.n)


@part
def keep(lobes, count):
    """The new number of lobes: count + 1 keeps row `count`; `count` drops it, because it is too dark or the array is full."""
    return count + 1 if lobes[count, PROBABILITY] > CUTOFF and count < LOBES - 1 else count


@part
def normalized(v, fallback):
    """v / |v|; `fallback` if v is zero."""
    return normalize(v) if dot(v, v) > F(0) else fallback
