"""A lobe is one row of float32 in the scratch array; its columns are named here."""

import numpy as np

from ..kernels import part
from ..kernels.sampling import F, dot, luminance, normalize

LOBES, COLUMNS = 65, 32  # shape of the scratch array: as many lobes as Cycles keeps, and one row more, so that writing needs no test
CUTOFF = F(1e-5)  # lobes of a smaller albedo are left out

# Kinds of lobes.
DIFFUSE, OREN_NAYAR, SHEEN, TRANSLUCENT, GLOSSY, GLASS, REFRACTION = (F(k) for k in range(7))

# Columns of every lobe; a vector or a colour takes three. np.int64, because Numba compiles anew for every literal number.
KIND = np.int64(0)
PROBABILITY = np.int64(1)  # of being picked
SINGULAR = np.int64(2)  # 1 if the lobe scatters into single directions
BUMPED = np.int64(3)  # 1 if the lobe's normal is not the surface's shading normal
NORMAL = np.int64(4)
WEIGHT = np.int64(7)  # factor on the lobe, with its energy compensation
ALBEDO = np.int64(10)  # estimate of the share of light that the lobe scatters, RGB
SMOOTH_NORMAL = np.int64(13)  # the surface's shading normal

# Columns of microfacet lobes. Oren-Nayar and sheen use the first ones for their own.
TANGENT = np.int64(16)
ALPHA_X, ALPHA_Y = np.int64(19), np.int64(20)
IOR = np.int64(21)  # of the far side over this one
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
def write(lobes, k, kind, point, n, weight, albedo):
    """Fill in the columns that every lobe has; PROBABILITY is relative for now."""
    lobes[k, KIND] = kind
    lobes[k, PROBABILITY] = luminance(albedo)
    lobes[k, SINGULAR] = F(0)
    put(lobes, k, NORMAL, n)
    put(lobes, k, WEIGHT, weight)
    put(lobes, k, ALBEDO, albedo)
    bumped = n != point.n
    lobes[k, BUMPED] = F(1) if bumped else F(0)
    if bumped:
        put(lobes, k, SMOOTH_NORMAL, point.n)


@part
def keep(lobes, count):
    """`count` + 1, which keeps the lobe just written as row `count`; `count` if it is too dark or one too many."""
    return count + 1 if lobes[count, PROBABILITY] > CUTOFF and count < LOBES - 1 else count


@part
def normalized(v, fallback):
    """The unit vector along v, or the fallback where v is zero."""
    return normalize(v) if dot(v, v) > F(0) else fallback
