"""The Principled BSDF: sheen over coat over metal, glass, and specular over diffuse.

Each layer lowers the weight of the layers below by its albedo. Tints, ior and weights mean the same as in Cycles.
"""

import math
from typing import NamedTuple

from ..kernels import part
from ..kernels.sampling import F, multiply, scale
from . import diffuse, fresnel, glass, glossy, oren_nayar, sheen
from .closures import aspect, relative_ior
from .frames import turned
from .inputs import WEIGHT, color, columns, factor, normal, number, positive, tangent
from .lobe import ALBEDO, CUTOFF, get, keep, normalized
from .normals import reflectable

_P = columns("principled")
_BLACK, _WHITE = (F(0), F(0), F(0)), (F(1), F(1), F(1))


class _Interface(NamedTuple):
    """The common properties of metal, glass and specular reflection."""

    n: tuple
    alpha: tuple
    tangent: tuple
    multiscatter: F


@part
def transparency(inputs):
    """The share of light that passes straight on, RGB."""
    return scale(color(inputs, WEIGHT), F(1) - factor(inputs, _P.alpha))


@part
def emission(inputs, point):
    """Radiance towards wo, through sheen and coat."""
    strength = number(inputs, _P.emission_strength)
    if strength == F(0):
        return F(0), F(0), F(0)
    weight = _under_coat(inputs, point, _under_sheen(inputs, point, _opaque(inputs)))
    return multiply(scale(color(inputs, _P.emission_color), strength), weight)


@part
def add_principled(inputs, point, lobes, count):
    """Write the lobes from row `count` on. Returns the new number of lobes."""
    weight = _opaque(inputs)
    count, weight = _add_sheen(inputs, point, lobes, count, weight)
    count, weight = _add_coat(inputs, point, lobes, count, weight)
    interface = _interface(inputs, point)
    count, weight = _add_metal(inputs, point, lobes, count, weight, interface)
    count, weight = _add_glass(inputs, point, lobes, count, weight, interface)
    if weight == _BLACK:
        return count
    count, weight = _add_specular(inputs, point, lobes, count, weight, interface)
    return _add_diffuse(inputs, point, lobes, count, weight)


@part
def _opaque(inputs):
    return scale(color(inputs, WEIGHT), factor(inputs, _P.alpha))


@part
def _under(layer, weight):
    """(1 - max_c layer_c / weight_c) weight: the weight below a layer. layer: its weighted albedo; weight: of the layer and all below."""
    taken = F(0)
    for i in range(3):
        if weight[i] > F(0):
            taken = max(taken, layer[i] / weight[i])
    return scale(weight, fresnel.saturate(F(1) - taken))


# --- sheen -----------------------------------------------------------------------------------------------------------


@part
def _sheen(inputs, point, weight):
    """Weight, normal and roughness of the sheen."""
    n = normal(inputs, _P.normal, point.n)
    coat = factor(inputs, _P.coat_weight)
    blend = fresnel.lerp(n, normal(inputs, _P.coat_normal, n), coat)
    share = max(number(inputs, _P.sheen_weight), F(0))
    tint = multiply(weight, color(inputs, _P.sheen_tint))
    return scale(tint, share), normalized(blend, n), factor(inputs, _P.sheen_roughness)


@part
def _has_sheen(inputs):
    return number(inputs, _P.sheen_weight) > CUTOFF


@part
def _under_sheen(inputs, point, weight):
    if not _has_sheen(inputs):
        return weight
    tint, n, roughness = _sheen(inputs, point, weight)
    return _under(scale(tint, sheen.albedo(n, point.wo, roughness)), weight)


@part
def _add_sheen(inputs, point, lobes, count, weight):
    if not _has_sheen(inputs):
        return count, weight
    tint, n, roughness = _sheen(inputs, point, weight)
    sheen.setup(lobes, count, point, n, tint, roughness)
    return keep(lobes, count), _under_sheen(inputs, point, weight)


# --- coat ------------------------------------------------------------------------------------------------------------


@part
def _coat(inputs, point, weight):
    """Weight, normal, f0, ior and squared roughnesses of the coat."""
    n = normal(inputs, _P.normal, point.n)
    n = reflectable(point.ng, point.wo, normal(inputs, _P.coat_normal, n))
    ior = max(number(inputs, _P.coat_ior), F(1))
    f0, roughness = fresnel.normal_reflectance(ior), factor(inputs, _P.coat_roughness)
    share = number(inputs, _P.coat_weight)
    return scale(weight, share), n, (f0, f0, f0), ior, (roughness * roughness, roughness * roughness)


@part
def _has_coat(inputs):
    return number(inputs, _P.coat_weight) > CUTOFF


@part
def _absorbed(inputs, n, wo, ior):
    """lerp(1, tint^(1 / cos t), coat weight), RGB, t the refracted angle: the share of light that remains after crossing the coat once."""
    share = number(inputs, _P.coat_weight)
    tint = color(inputs, _P.coat_tint)
    depth = F(1) / fresnel.refracted_cosine(n[0] * wo[0] + n[1] * wo[1] + n[2] * wo[2], ior)
    return fresnel.lerp(_WHITE, (tint[0] ** depth, tint[1] ** depth, tint[2] ** depth), share)


@part
def _under_coat(inputs, point, weight):
    if not _has_coat(inputs):
        return weight
    coat, n, f0, ior, alpha = _coat(inputs, point, weight)
    below = _under(glossy.dielectric_layer(n, point.wo, coat, f0, ior, alpha, F(1))[2], weight)
    return multiply(below, _absorbed(inputs, n, point.wo, ior))


@part
def _add_coat(inputs, point, lobes, count, weight):
    if not _has_coat(inputs):
        return count, weight
    coat, n, f0, ior, alpha = _coat(inputs, point, weight)
    glossy.setup_dielectric(lobes, count, point, n, coat, f0, ior, alpha, (F(0), F(0), F(0)), F(1))
    return keep(lobes, count), _under_coat(inputs, point, weight)


# --- base ------------------------------------------------------------------------------------------------------------


@part
def _interface(inputs, point):
    n = normal(inputs, _P.normal, point.n)
    roughness = factor(inputs, _P.roughness)
    alpha = aspect(roughness * roughness, factor(inputs, _P.anisotropic))
    turns = number(inputs, _P.anisotropic_rotation)
    t = turned(tangent(inputs, _P.tangent), n, turns)
    multiscatter = number(inputs, _P.multiscatter)
    return _Interface(reflectable(point.ng, point.wo, n), alpha, t, multiscatter)


@part
def _base_color(inputs):
    c = color(inputs, _P.base_color)
    return min(c[0], F(1)), min(c[1], F(1)), min(c[2], F(1))


@part
def _tinted_f0(inputs, f0):
    """Reflectance at normal incidence with the specular tint."""
    c = scale(color(inputs, _P.specular_tint), f0)
    return fresnel.saturate(c[0]), fresnel.saturate(c[1]), fresnel.saturate(c[2])


@part
def _add_metal(inputs, point, lobes, count, weight, interface):
    share = factor(inputs, _P.metallic)
    if share <= CUTOFF:
        return count, weight
    edge = color(inputs, _P.specular_tint)
    edge = min(edge[0], F(1)), min(edge[1], F(1)), min(edge[2], F(1))
    n, alpha, t, multiscatter = interface
    f0 = _base_color(inputs)
    glossy.setup_metal(lobes, count, point, n, scale(weight, share), f0, edge, alpha, t, multiscatter)
    return keep(lobes, count), scale(weight, F(1) - share)


@part
def _add_glass(inputs, point, lobes, count, weight, interface):
    share = factor(inputs, _P.transmission)
    if share <= CUTOFF:
        return count, weight
    c = _base_color(inputs)
    tints = _WHITE, (math.sqrt(c[0]), math.sqrt(c[1]), math.sqrt(c[2]))  # light that enters and leaves has the root twice
    ior, roughness = positive(inputs, _P.ior), factor(inputs, _P.roughness)
    f0 = _tinted_f0(inputs, fresnel.normal_reflectance(ior))
    inside = relative_ior(point, ior)
    glass.setup(lobes, count, point, interface.n, scale(weight, share), f0, inside, roughness * roughness, tints, interface.multiscatter)
    return keep(lobes, count), scale(weight, F(1) - share)


@part
def _specular_ior(ior, level):
    """(ior', f0'), f0' = 2 level f0(ior): the reflectance at normal incidence, and the ior that has it. level 0.5 changes nothing."""
    f0 = fresnel.normal_reflectance(ior)
    if level == F(0.5):
        return ior, f0
    f0 *= F(2) * level
    adjusted = fresnel.ior_of(f0)
    return F(1) / adjusted if ior < F(1) else adjusted, f0


@part
def _add_specular(inputs, point, lobes, count, weight, interface):
    level = max(number(inputs, _P.specular_ior_level), F(0))
    ior, f0 = _specular_ior(positive(inputs, _P.ior), level)
    if ior == F(1) or max(weight[0], weight[1], weight[2]) <= CUTOFF:
        return count, weight
    n, alpha, t, multiscatter = interface
    tinted = _tinted_f0(inputs, f0)
    glossy.setup_dielectric(lobes, count, point, n, weight, tinted, ior, alpha, t, multiscatter)
    return keep(lobes, count), _under(get(lobes, count, ALBEDO), weight)


@part
def _add_diffuse(inputs, point, lobes, count, weight):
    n = normal(inputs, _P.normal, point.n)
    base = color(inputs, _P.base_color)
    roughness = factor(inputs, _P.diffuse_roughness)
    if roughness < F(1e-5):
        diffuse.setup(lobes, count, point, n, multiply(base, weight))
    else:
        oren_nayar.setup(lobes, count, point, n, multiply(base, weight), base, roughness)
    return keep(lobes, count)
