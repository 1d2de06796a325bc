"""Microfacet reflection: GGX with one of three Fresnel curves. A tangent orients an anisotropic lobe."""

from ..kernels import part
from ..kernels.sampling import F, add, cross, dot, multiply, normalize, scale, subtract, tangents, to_local, to_world
from . import energy, fresnel
from .frames import frame
from .lobe import (
    ALPHA_X,
    ALPHA_Y,
    APART,
    F0,
    F82,
    FRESNEL,
    GLOSSY,
    IOR,
    NORMAL,
    ROUGH_REFLECTION,
    SINGLE,
    SPREAD,
    TANGENT,
    WEIGHT,
    get,
    put,
    write,
)
from .microfacet import distribution, distribution_anisotropic, smith, smith_anisotropic, visible_normal

SINGULAR_ALPHA2 = F(2e-10)  # surfaces with a smaller alpha^2 are singular: no density is computed
ROUGH_ALPHA2 = F(0.04)  # from this alpha^2 on, guides may draw directions
_WHITE, _SCHLICK, _METAL = F(0), F(1), F(2)  # Fresnel curves


@part
def _compensated(weight, fss, alpha, cosine, multiscatter):
    """(weight * darkening, gain 1 / E). Their product compensates for the light that microfacets scatter more than once."""
    if multiscatter == F(0):
        return weight, F(1)
    e, average = energy.reflection_albedo(energy.roughness_of(alpha[0], alpha[1]), cosine)
    return multiply(weight, energy.darkening(average, e, fss)), F(1) / e


@part
def _spread(alpha2):
    if alpha2 <= SINGULAR_ALPHA2:
        return SINGLE
    return ROUGH_REFLECTION if alpha2 >= ROUGH_ALPHA2 else APART


@part
def _setup(lobes, k, point, n, weight, gain, albedo, alpha, tangent):
    """Write row k, except the columns of its Fresnel curve."""
    write(lobes, k, GLOSSY, _spread(alpha[0] * alpha[1]), point, n, scale(weight, gain), albedo)
    lobes[k, ALPHA_X] = alpha[0]
    lobes[k, ALPHA_Y] = alpha[1]
    put(lobes, k, TANGENT, tangent)


@part
def setup(lobes, k, point, n, weight, color, alpha, tangent, multiscatter):
    """Write a lobe without Fresnel as row k. alpha: squared roughness along the tangent, and across it; at most 1 each.

    weight: RGB, with the colour as a factor. color: tints the light that microfacets scatter more than once.
    """
    weight, gain = _compensated(weight, color, alpha, dot(n, point.wo), multiscatter)
    _setup(lobes, k, point, n, weight, gain, weight, alpha, tangent)
    lobes[k, FRESNEL] = _WHITE


@part
def dielectric_layer(n, wo, weight, f0, ior, alpha, multiscatter):
    """(weight, gain, albedo) of a dielectric's reflection. f0: its reflectance at normal incidence, RGB."""
    fss = fresnel.towards_white(f0, fresnel.schlick_share_average(ior))
    weight, gain = _compensated(weight, fss, alpha, dot(n, wo), multiscatter)
    share = energy.schlick_albedo(energy.roughness_of(alpha[0], alpha[1]), dot(n, wo), ior)
    return weight, gain, multiply(weight, fresnel.towards_white(f0, share))


@part
def setup_dielectric(lobes, k, point, n, weight, f0, ior, alpha, tangent, multiscatter):
    """Write the lobe of `dielectric_layer` as row k; f0 is at most 1."""
    weight, gain, albedo = dielectric_layer(n, point.wo, weight, f0, ior, alpha, multiscatter)
    _setup(lobes, k, point, n, weight, gain, albedo, alpha, tangent)
    lobes[k, FRESNEL] = _SCHLICK
    lobes[k, IOR] = ior
    put(lobes, k, F0, f0)


@part
def setup_metal(lobes, k, point, n, weight, f0, tint, alpha, tangent, multiscatter):
    """Write a metal's reflection as row k. f0: reflectance at normal incidence; tint: colour near the edge (F82-tint)."""
    b = fresnel.f82_lowering(f0, tint)
    weight, gain = _compensated(weight, fresnel.f82_average(f0, b), alpha, dot(n, point.wo), multiscatter)
    share = energy.schlick5_albedo(energy.roughness_of(alpha[0], alpha[1]), dot(n, point.wo))
    _setup(lobes, k, point, n, weight, gain, multiply(weight, fresnel.towards_white(f0, share)), alpha, tangent)
    lobes[k, FRESNEL] = _METAL
    put(lobes, k, F0, f0)
    put(lobes, k, F82, b)


@part
def reflectance(lobes, k, cosine):
    """The share of light that a microfacet reflects, RGB."""
    if lobes[k, FRESNEL] == _SCHLICK:
        return fresnel.towards_white(get(lobes, k, F0), fresnel.schlick_share(cosine, lobes[k, IOR]))
    if lobes[k, FRESNEL] == _METAL:
        return fresnel.f82(cosine, get(lobes, k, F0), get(lobes, k, F82))
    return F(1), F(1), F(1)


@part
def mirrored(v, h):
    """The mirror direction of v about the unit vector h."""
    return subtract(scale(h, F(2) * dot(v, h)), v)


@part
def _shape(lobes, k, wo, wi, h):
    """(D(h), Lambda(wo), Lambda(wi)). h is the half vector of wo and wi. wo and wi are on the upper side of the lobe's normal."""
    n, alpha_x, alpha_y = get(lobes, k, NORMAL), lobes[k, ALPHA_X], lobes[k, ALPHA_Y]
    if alpha_x == alpha_y:
        across, along, alpha2 = cross(n, h), dot(n, h), alpha_x * alpha_y
        d = distribution(alpha2, dot(across, across), along * along)
        return d, smith(alpha2, dot(n, wo)), smith(alpha2, dot(n, wi))
    t, b = frame(n, get(lobes, k, TANGENT))
    d = distribution_anisotropic(alpha_x, alpha_y, to_local(t, b, n, h))
    shadow_o = smith_anisotropic(alpha_x, alpha_y, to_local(t, b, n, wo))
    return d, shadow_o, smith_anisotropic(alpha_x, alpha_y, to_local(t, b, n, wi))


@part
def evaluate(lobes, k, wo, wi):
    """(f |cos|, RGB; the density of `sample`). Both directions must be on the upper side of the lobe's normal."""
    h = normalize(add(wo, wi))
    d, shadow_o, shadow_i = _shape(lobes, k, wo, wi, h)
    common = d * F(0.25) / dot(get(lobes, k, NORMAL), wo)
    r = multiply(reflectance(lobes, k, dot(wo, h)), get(lobes, k, WEIGHT))
    return scale(r, common / (F(1) + shadow_o + shadow_i)), common / (F(1) + shadow_o)


@part
def half_vector(lobes, k, wo, u, v):
    """A random microfacet normal that wo sees, in world space; the lobe's own normal if the lobe is singular."""
    n, alpha_x, alpha_y = get(lobes, k, NORMAL), lobes[k, ALPHA_X], lobes[k, ALPHA_Y]
    if lobes[k, SPREAD] == SINGLE:
        return n
    t, b = tangents(n)
    if alpha_x != alpha_y:
        t, b = frame(n, get(lobes, k, TANGENT))
    return to_world(t, b, n, visible_normal(alpha_x, alpha_y, to_local(t, b, n, wo), u, v))


@part
def sample(lobes, k, wo, u, v):
    """A direction wi. wi may be on the lower side of the lobe's normal; the lobe is 0 there."""
    return mirrored(wo, half_vector(lobes, k, wo, u, v))


@part
def singular(lobes, k, wo):
    """Throughput of the mirror direction, RGB."""
    return multiply(reflectance(lobes, k, dot(get(lobes, k, NORMAL), wo)), get(lobes, k, WEIGHT))
