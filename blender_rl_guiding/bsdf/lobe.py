"""How a lobe lies in the scratch array: one row of float32, its columns named here."""

import numpy as np

from ..kernels import kernel
from ..sampling import F, dot, luminance, normalize

LOBES, COLUMNS = 16, 32  # shape of the scratch array; the last row is never kept, so that writing needs no test
CUTOFF = F(1e-5)  # lobes of a smaller albedo are left out

# Kinds of lobes.
DIFFUSE, OREN_NAYAR, SHEEN, TRANSLUCENT, GLOSSY, GLASS, REFRACTION = (F(k) for k in range(7))

I = np.int64  # typed, as kernels are compiled once more for every literal number they are given
# Columns of every lobe. Three columns hold a vector or a colour.
KIND = I(0)
PROBABILITY = I(1)  # of being picked
SINGULAR = I(2)  # 1 if the lobe scatters into single directions
BUMPED = I(3)  # 1 if the lobe's normal is not the surface's shading normal
NORMAL = I(4)
WEIGHT = I(7)  # factor on the lobe, with its energy compensation
ALBEDO = I(10)  # estimate of the share of light that the lobe scatters, RGB
SMOOTH_NORMAL = I(13)  # the surface's shading normal

# Columns of microfacet lobes. Oren-Nayar and sheen use the first ones for their own.
TANGENT = I(16)
ALPHA_X, ALPHA_Y = I(19), I(20)
IOR = I(21)  # of the far side over this one
F0 = I(22)
F82 = I(25)  # of metals: what Schlick's curve is lowered by
TRANSMISSION_TINT = I(25)  # of glass
REFLECTION_TINT = I(28)  # of glass
FRESNEL = I(31)


@kernel
def get(lobes, k, column):
    """The vector or colour in three columns of lobe k."""
    return lobes[k, column], lobes[k, column + 1], lobes[k, column + 2]


@kernel
def put(lobes, k, column, v):
    """Write a vector or colour to three columns of lobe k."""
    lobes[k, column] = v[0]
    lobes[k, column + 1] = v[1]
    lobes[k, column + 2] = v[2]


@kernel
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


@kernel
def keep(lobes, count):
    """The number of lobes with the one just written as row `count`, unless it is too dark or one too many."""
    return count + 1 if lobes[count, PROBABILITY] > CUTOFF and count < LOBES - 1 else count


@kernel
def normalized(v, fallback):
    """The unit vector along v, or the fallback where v is zero."""
    return normalize(v) if dot(v, v) > F(0) else fallback
