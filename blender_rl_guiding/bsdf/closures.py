"""The lobes of a shader's closures, except Principled. Each `add_...` writes row `count`, and returns the new number of lobes."""

import math

from ..kernels import part
from ..kernels.sampling import F, multiply, scale
from . import diffuse, glass, glossy, oren_nayar, sheen, translucent
from .frames import turned
from .fresnel import normal_reflectance
from .inputs import WEIGHT, color, columns, factor, normal, number, positive, tangent
from .lobe import keep
from .normals import reflectable

_EMISSION = columns("emission")
_DIFFUSE, _TRANSLUCENT, _SHEEN = columns("diffuse"), columns("translucent"), columns("sheen")
_GLOSSY, _METALLIC = columns("glossy"), columns("metallic")
_GLASS, _REFRACTION = columns("glass"), columns("refraction")
_SMOOTH = F(1e-5)  # roughness below which diffuse reflection is Lambert's


@part
def tinted_weight(inputs, row):
    """The closure's weight times the colour in row `row` of its inputs, RGB."""
    return multiply(color(inputs, WEIGHT), color(inputs, row))


@part
def emission(inputs):
    """Radiance of an Emission or Background, RGB."""
    return scale(tinted_weight(inputs, _EMISSION.color), number(inputs, _EMISSION.strength))


@part
def relative_ior(point, ior):
    """(ior on the far side) / (ior on wo's side), for a closed surface filled with `ior`."""
    return F(1) / ior if point.backfacing else ior


@part
def aspect(alpha, anisotropy):
    """(alpha_x, alpha_y) of Principled and Metallic: squared roughness along the tangent and across it."""
    if anisotropy == F(0):
        return alpha, alpha
    ratio = math.sqrt(F(1) - F(0.9) * anisotropy)
    return min(alpha / ratio, F(1)), alpha * ratio


@part
def _stretch(alpha, anisotropy):
    """(alpha_x, alpha_y) of the Glossy BSDF."""
    a = min(max(anisotropy, F(-0.99)), F(0.99))
    if a < F(0):
        return min(alpha / (F(1) + a), F(1)), alpha * (F(1) + a)
    return alpha * (F(1) - a), min(alpha / (F(1) - a), F(1))


@part
def add_diffuse(inputs, point, lobes, count):
    """Diffuse BSDF: Lambert, or Oren-Nayar where it is rough."""
    n = normal(inputs, _DIFFUSE.normal, point.n)
    weight = tinted_weight(inputs, _DIFFUSE.color)
    roughness = factor(inputs, _DIFFUSE.roughness)
    if roughness < _SMOOTH:
        diffuse.setup(lobes, count, point, n, weight)
    else:
        oren_nayar.setup(lobes, count, point, n, weight, color(inputs, _DIFFUSE.color), roughness)
    return keep(lobes, count)


@part
def add_translucent(inputs, point, lobes, count):
    """Translucent BSDF."""
    n = reflectable(point.ng, point.wo, normal(inputs, _TRANSLUCENT.normal, point.n))
    translucent.setup(lobes, count, point, n, tinted_weight(inputs, _TRANSLUCENT.color))
    return keep(lobes, count)


@part
def add_sheen(inputs, point, lobes, count):
    """Sheen BSDF (microfiber)."""
    n = normal(inputs, _SHEEN.normal, point.n)
    roughness = factor(inputs, _SHEEN.roughness)
    sheen.setup(lobes, count, point, n, tinted_weight(inputs, _SHEEN.color), roughness)
    return keep(lobes, count)


@part
def add_glossy(inputs, point, lobes, count):
    """Glossy BSDF."""
    n = reflectable(point.ng, point.wo, normal(inputs, _GLOSSY.normal, point.n))
    roughness = factor(inputs, _GLOSSY.roughness)
    anisotropy = number(inputs, _GLOSSY.anisotropy)
    rotation = number(inputs, _GLOSSY.rotation)
    multiscatter = number(inputs, _GLOSSY.multiscatter)
    t = turned(tangent(inputs, _GLOSSY.tangent), n, rotation)
    weight = tinted_weight(inputs, _GLOSSY.color)
    fss = color(inputs, _GLOSSY.color)
    glossy.setup(lobes, count, point, n, weight, fss, _stretch(roughness * roughness, anisotropy), t, multiscatter)
    return keep(lobes, count)


@part
def add_metallic(inputs, point, lobes, count):
    """Metallic BSDF (F82-tint)."""
    bent = normal(inputs, _METALLIC.normal, point.n)
    roughness = factor(inputs, _METALLIC.roughness)
    alpha = aspect(roughness * roughness, factor(inputs, _METALLIC.anisotropy))
    rotation = number(inputs, _METALLIC.rotation)
    multiscatter = number(inputs, _METALLIC.multiscatter)
    t = turned(tangent(inputs, _METALLIC.tangent), bent, rotation)
    f0, tint = color(inputs, _METALLIC.base_color), color(inputs, _METALLIC.edge_tint)
    n = reflectable(point.ng, point.wo, bent)
    weight = color(inputs, WEIGHT)
    glossy.setup_metal(lobes, count, point, n, weight, f0, tint, alpha, t, multiscatter)
    return keep(lobes, count)


@part
def add_glass(inputs, point, lobes, count):
    """Glass BSDF."""
    n = reflectable(point.ng, point.wo, normal(inputs, _GLASS.normal, point.n))
    roughness = factor(inputs, _GLASS.roughness)
    ior = positive(inputs, _GLASS.ior)
    multiscatter = number(inputs, _GLASS.multiscatter)
    f0, tint = normal_reflectance(ior), color(inputs, _GLASS.color)
    weight, ior, alpha = color(inputs, WEIGHT), relative_ior(point, ior), roughness * roughness
    glass.setup(lobes, count, point, n, weight, (f0, f0, f0), ior, alpha, (tint, tint), multiscatter)
    return keep(lobes, count)


@part
def add_refraction(inputs, point, lobes, count):
    """Refraction BSDF."""
    n = reflectable(point.ng, point.wo, normal(inputs, _REFRACTION.normal, point.n))
    roughness = factor(inputs, _REFRACTION.roughness)
    ior = relative_ior(point, positive(inputs, _REFRACTION.ior))
    weight = tinted_weight(inputs, _REFRACTION.color)
    glass.setup_refraction(lobes, count, point, n, weight, ior, roughness * roughness)
    return keep(lobes, count)
