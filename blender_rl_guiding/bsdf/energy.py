"""Albedos of microfacet lobes, from tables, and the energy that they lose to light scattered more than once.

The compensation is that of Kulla and Conty 2017 as Cycles has it: the lobe is divided by its albedo E, and darkened where the
colour of repeated reflections demands it. Tables: see `precompute`.
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
    """Where x in [0, 1] lies among equally spaced samples: the one below, the one above, and the share of the latter."""
    at = min(x, F(1)) * F(size - 1) if x > F(0) else F(0)  # NaN counts as 0, so that none of a texture's leads out of the table
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
    """The roughness that the tables are made for."""
    return math.sqrt(math.sqrt(alpha_x * alpha_y))


@part
def ior_coordinate(ior):
    """Where the tables have an ior above 1, or its inverse."""
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
    """The share of white in the albedo of a lobe whose reflectance runs from f0 to white by `fresnel.schlick_share`."""
    return _trilinear(_SCHLICK, ior_coordinate(ior), cosine, roughness)


@part
def schlick5_albedo(roughness, cosine):
    """The same for Schlick's curve with the exponent 5."""
    return _bilinear(_SCHLICK5, cosine, roughness)


@part
def sheen_fit(cosine, roughness):
    """a and b of the sheen's transformed cosine, and its albedo."""
    return _bilinear(_SHEEN[0], cosine, roughness), _bilinear(_SHEEN[1], cosine, roughness), _bilinear(_SHEEN[2], cosine, roughness)


@part
def _darkening(average, albedo, fss):
    """The share of a compensated lobe that remains where each reflection keeps fss of the light."""
    fms = fss * average / (F(1) - fss * (F(1) - average))
    return albedo + fms * (F(1) - albedo)


@part
def darkening(average, albedo, fss):
    """`_darkening` for each colour; a lobe of albedo 1 for white is multiplied by it."""
    return _darkening(average, albedo, fss[0]), _darkening(average, albedo, fss[1]), _darkening(average, albedo, fss[2])
