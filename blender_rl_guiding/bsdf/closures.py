"""From a shader's closures to lobes: all of them but Principled. Each `add_...` returns the new number of lobes."""

from ..kernels import part
from ..sampling import F, multiply, scale
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
def tinted_weight(registers, row):
    """The closure's weight times the colour in a register."""
    return multiply(color(registers, WEIGHT), color(registers, row))


@part
def emission(registers):
    """Radiance of an Emission or Background, RGB."""
    return scale(tinted_weight(registers, _EMISSION.color), number(registers, _EMISSION.strength))


@part
def relative_ior(point, ior):
    """The ior of the far side over that of wo's side, for a closed surface filled with `ior`."""
    return F(1) / ior if point.backfacing else ior


@part
def aspect(alpha, anisotropy):
    """The pair of squared roughnesses of Principled and Metallic, along the tangent and across it."""
    ratio = (F(1) - F(0.9) * anisotropy) ** F(0.5)
    return min(alpha / ratio, F(1)), alpha * ratio


@part
def _stretch(alpha, anisotropy):
    """The pair of squared roughnesses of the Glossy BSDF."""
    a = min(max(anisotropy, F(-0.99)), F(0.99))
    if a < F(0):
        return min(alpha / (F(1) + a), F(1)), alpha * (F(1) + a)
    return alpha * (F(1) - a), min(alpha / (F(1) - a), F(1))


@part
def add_diffuse(registers, point, lobes, count):
    """Diffuse BSDF: Lambert, or Oren-Nayar where it is rough."""
    n = normal(registers, _DIFFUSE.normal, point.n)
    weight = tinted_weight(registers, _DIFFUSE.color)
    roughness = factor(registers, _DIFFUSE.roughness)
    if roughness < _SMOOTH:
        diffuse.setup(lobes, count, point, n, weight)
    else:
        oren_nayar.setup(lobes, count, point, n, weight, color(registers, _DIFFUSE.color), roughness)
    return keep(lobes, count)


@part
def add_translucent(registers, point, lobes, count):
    """Translucent BSDF."""
    n = reflectable(point.ng, point.wo, normal(registers, _TRANSLUCENT.normal, point.n))
    translucent.setup(lobes, count, point, n, tinted_weight(registers, _TRANSLUCENT.color))
    return keep(lobes, count)


@part
def add_sheen(registers, point, lobes, count):
    """Sheen BSDF (microfiber)."""
    n = normal(registers, _SHEEN.normal, point.n)
    roughness = factor(registers, _SHEEN.roughness)
    sheen.setup(lobes, count, point, n, tinted_weight(registers, _SHEEN.color), roughness)
    return keep(lobes, count)


@part
def add_glossy(registers, point, lobes, count):
    """Glossy BSDF."""
    n = reflectable(point.ng, point.wo, normal(registers, _GLOSSY.normal, point.n))
    roughness = factor(registers, _GLOSSY.roughness)
    anisotropy = number(registers, _GLOSSY.anisotropy)
    rotation = number(registers, _GLOSSY.rotation)
    multiscatter = number(registers, _GLOSSY.multiscatter)
    t = turned(tangent(registers, _GLOSSY.tangent), n, rotation)
    weight = tinted_weight(registers, _GLOSSY.color)
    fss = color(registers, _GLOSSY.color)
    glossy.setup(lobes, count, point, n, weight, fss, _stretch(roughness * roughness, anisotropy), t, multiscatter)
    return keep(lobes, count)


@part
def add_metallic(registers, point, lobes, count):
    """Metallic BSDF (F82-tint)."""
    bent = normal(registers, _METALLIC.normal, point.n)
    roughness = factor(registers, _METALLIC.roughness)
    alpha = aspect(roughness * roughness, factor(registers, _METALLIC.anisotropy))
    rotation = number(registers, _METALLIC.rotation)
    multiscatter = number(registers, _METALLIC.multiscatter)
    t = turned(tangent(registers, _METALLIC.tangent), bent, rotation)
    f0, tint = color(registers, _METALLIC.base_color), color(registers, _METALLIC.edge_tint)
    n = reflectable(point.ng, point.wo, bent)
    weight = color(registers, WEIGHT)
    glossy.setup_metal(lobes, count, point, n, weight, f0, tint, alpha, t, multiscatter)
    return keep(lobes, count)


@part
def add_glass(registers, point, lobes, count):
    """Glass BSDF."""
    n = reflectable(point.ng, point.wo, normal(registers, _GLASS.normal, point.n))
    roughness = factor(registers, _GLASS.roughness)
    ior = positive(registers, _GLASS.ior)
    multiscatter = number(registers, _GLASS.multiscatter)
    f0, tint = normal_reflectance(ior), color(registers, _GLASS.color)
    weight, ior, alpha = color(registers, WEIGHT), relative_ior(point, ior), roughness * roughness
    glass.setup(lobes, count, point, n, weight, (f0, f0, f0), ior, alpha, (tint, tint), multiscatter)
    return keep(lobes, count)


@part
def add_refraction(registers, point, lobes, count):
    """Refraction BSDF."""
    n = reflectable(point.ng, point.wo, normal(registers, _REFRACTION.normal, point.n))
    roughness = factor(registers, _REFRACTION.roughness)
    ior = relative_ior(point, positive(registers, _REFRACTION.ior))
    weight = tinted_weight(registers, _REFRACTION.color)
    glass.setup_refraction(lobes, count, point, n, weight, ior, roughness * roughness)
    return keep(lobes, count)
