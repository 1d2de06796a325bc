"""Rough diffuse reflection without loss of energy: Fujii's Oren-Nayar plus the multiple scattering of OpenPBR.

`diffuse` has the sampling. Sources: Fujii, "A tiny improvement of Oren-Nayar reflectance model"; Portsmouth, Kutz and Hill 2025, "EON".
"""

import math

from ..kernels import part
from ..kernels.sampling import INV_PI, PI, F, add, dot, multiply, scale
from .fresnel import saturate
from .lobe import ALPHA_X, ALPHA_Y, DIFFUSE_REFLECTION, F0, NORMAL, OREN_NAYAR, WEIGHT, get, put, write

_A, _B, _MULTIPLE = ALPHA_X, ALPHA_Y, F0  # columns: Fujii's A and B over pi, and the colour of the multiple scattering
_AVERAGE = (2 * math.pi - 5.6) / 3  # average of G over projected solid angle, with OpenPBR's rounding


@part
def _lost(a, b, cosine):
    """1 - E(cosine): the share of light that single scattering loses."""
    s = math.sqrt(max(F(1) - cosine * cosine, F(0)))
    if cosine < F(1e-6):
        g = PI / F(2) - F(2 / 3) - cosine  # the quotient in the other branch has no correct digits here
    else:
        g = s * (math.acos(min(cosine, F(1))) - F(2 / 3) - s * cosine) + F(2 / 3) * (s / cosine) * (F(1) - s * s * s)
    return F(1) - (a * PI + b * g)


@part
def _multiple(color, average):
    """Multiple scattering of one channel: c^2 A / (pi (1 - A) (1 - c (1 - A))), A = `average`, the average albedo of single scattering."""
    c = saturate(color)
    return INV_PI * c * c * (average / (F(1) - average)) / (F(1) - c * (F(1) - average))


@part
def setup(lobes, k, point, n, weight, color, roughness):
    """Write the lobe as row k. weight: RGB, with the colour as a factor. color: tints the multiple scattering."""
    write(lobes, k, OREN_NAYAR, DIFFUSE_REFLECTION, point, n, weight, weight)
    sigma = saturate(roughness)
    a = F(1) / (PI + sigma * (PI / F(2) - F(2 / 3)))
    b = sigma * a
    average = a * PI + F(_AVERAGE) * b
    multiple = _multiple(color[0], average), _multiple(color[1], average), _multiple(color[2], average)
    lobes[k, _A] = a
    lobes[k, _B] = b
    put(lobes, k, _MULTIPLE, scale(multiple, _lost(a, b, max(dot(n, point.wo), F(0)))))


@part
def evaluate(lobes, k, wo, wi):
    """f |cos|, RGB; zero below the lobe's normal."""
    n, a, b = get(lobes, k, NORMAL), lobes[k, _A], lobes[k, _B]
    cos_i, cos_o = max(dot(n, wi), F(0)), max(dot(n, wo), F(0))
    t = dot(wi, wo) - cos_i * cos_o
    if t > F(0):
        t /= max(cos_i, cos_o) + F(1e-30)
    single = a + b * t
    multiple = scale(get(lobes, k, _MULTIPLE), _lost(a, b, cos_i))
    return multiply(scale(get(lobes, k, WEIGHT), cos_i), add(multiple, (single, single, single)))
