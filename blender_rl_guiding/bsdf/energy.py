"""Albedos of microfacet lobes, from tables, and a compensation for the light that microfacets scatter more than once.

The compensation is that of Kulla and Conty 2017, as in Cycles: lobe / E * `darkening`, with E the albedo of single scattering.
`darkening` accounts for the loss in repeated coloured reflections. `precompute` makes the tables.
"""

import math
from pathlib import Path

import numpy as np

from ..kernels import part
from ..kernels.sampling import F

# Kernels hold these as constants.
_tables = np.load(Path(__file__).with_name("tables.npz"))
_GGX, _GGX_AVERAGE = _tables["ggx"], _tables["ggx_average"]
_GLASS, _GLASS_AVERAGE = _tables["glass"], _tables["glass_average"]
_SCHLICK, _SCHLICK5 = _tables["schlick"], _tables["schlick5"]
_SHEEN = _tables["sheen"]


@part
def _cell(x, size):
    """(index of the sample below x, index of the one above, weight of the one above), for `size` equally spaced samples on [0, 1]."""
    at = min(x, F(1)) * F(size - 1) if x > F(0) else F(0)  # NaN, perhaps from a texture, counts as 0, so the index is valid
    low = np.int32(at)
    return low, min(low + 1, size - 1), at - F(low)


@part
def _between(a, b, share):
    return a + share * (b - a)


@part
def _linear(table, x):
    low, high, share = _cell(x, table.shape[0])
    return _between(table[low], table[high], share)


@part
def _bilinear(table, x, y):
    low, high, share = _cell(x, table.shape[0])
    return _between(_linear(table[low], y), _linear(table[high], y), share)


@part
def _trilinear(table, x, y, z):
    low, high, share = _cell(x, table.shape[0])
    return _between(_bilinear(table[low], y, z), _bilinear(table[high], y, z), share)


@part
def roughness_of(alpha_x, alpha_y):
    """(alpha_x alpha_y)^(1/4), the roughness in the tables."""
    return math.sqrt(math.sqrt(alpha_x * alpha_y))


@part
def ior_coordinate(ior):
    """z = sqrt(|ior - 1| / (ior + 1)), the coordinate of an ior in the tables. ior and 1 / ior have the same z."""
    return math.sqrt(abs(ior - F(1)) / (ior + F(1)))


@part
def reflection_albedo(roughness, cosine):
    """Albedo E of a perfect conductor, and its average over projected solid angle."""
    return _bilinear(_GGX, cosine, roughness), _linear(_GGX_AVERAGE, roughness)


@part
def glass_albedo(roughness, cosine, ior):
    """Albedo E of reflection and refraction together, and its average."""
    side, z = 0 if ior >= F(1) else 1, ior_coordinate(ior)
    return _trilinear(_GLASS[side], z, cosine, roughness), _bilinear(_GLASS_AVERAGE[side], z, roughness)


@part
def schlick_albedo(roughness, cosine, ior):
    """The s in albedo = f0 + s (1 - f0), for a compensated lobe whose Fresnel curve is `fresnel.schlick_share`."""
    return _trilinear(_SCHLICK, ior_coordinate(ior), cosine, roughness)


@part
def schlick5_albedo(roughness, cosine):
    """The s of `schlick_albedo` for Schlick's Fresnel curve (1 - cos)^5."""
    return _bilinear(_SCHLICK5, cosine, roughness)


@part
def sheen_fit(cosine, roughness):
    """(a, b, albedo) of the sheen, with a and b as in `sheen`."""
    return _bilinear(_SHEEN[0], cosine, roughness), _bilinear(_SHEEN[1], cosine, roughness), _bilinear(_SHEEN[2], cosine, roughness)


@part
def _darkening(average, albedo, fss):
    """E + fms (1 - E), fms = fss A / (1 - fss (1 - A)): the albedo with all orders of scattering, if each reflection keeps the share fss.

    albedo: E, of single scattering without loss. average: A, E averaged over projected solid angle.
    """
    fms = fss * average / (F(1) - fss * (F(1) - average))
    return albedo + fms * (F(1) - albedo)


@part
def darkening(average, albedo, fss):
    """The factor on (lobe / E): `_darkening` of each channel, RGB."""
    return _darkening(average, albedo, fss[0]), _darkening(average, albedo, fss[1]), _darkening(average, albedo, fss[2])
