"""Microfacet glass: reflection and refraction by one interface, or refraction alone.

As in Cycles, transmitted light is not scaled by the square of the ior: f |cos| integrates to the transmittance. A microfacet that faces
away from wo or wi transmits nothing. Cycles' sampling has the same rule; Cycles' evaluation has not.
"""

from ..kernels import part
from ..kernels.sampling import F, add, cross, dot, multiply, normalize, scale, subtract
from . import energy, fresnel
from .glossy import SINGULAR_ALPHA2, half_vector, mirrored
from .lobe import (
    ALPHA_X,
    ALPHA_Y,
    APART,
    F0,
    GLASS,
    IOR,
    KIND,
    NORMAL,
    REFLECTION_TINT,
    REFRACTION,
    SINGLE,
    TRANSMISSION_TINT,
    WEIGHT,
    get,
    put,
    write,
)
from .microfacet import distribution, smith

_THIRD = F(1 / 3)


@part
def _spread(ior, alpha):
    # At ior = 1 light passes straight on, at every roughness.
    return SINGLE if alpha * alpha <= SINGULAR_ALPHA2 or abs(ior - F(1)) < F(1e-4) else APART


@part
def _interface(lobes, k, ior, alpha):
    lobes[k, IOR] = ior
    lobes[k, ALPHA_X] = lobes[k, ALPHA_Y] = alpha


@part
def setup(lobes, k, point, n, weight, f0, ior, alpha, tints, multiscatter):
    """Write glass as row k. tints: (colour of reflection, colour of transmission). f0: RGB, at most 1."""
    cosine, roughness, gain = dot(n, point.wo), energy.roughness_of(alpha, alpha), F(1)
    if multiscatter != F(0):
        e, average = energy.glass_albedo(roughness, cosine, ior)
        opaque = max(tints[1][0], tints[1][1], tints[1][2]) == F(0)
        fss = multiply(tints[0], fresnel.towards_white(f0, fresnel.schlick_share_average(ior))) if opaque else tints[1]
        weight = multiply(weight, energy.darkening(average, e, fss))
        gain = F(1) / e
    share = fresnel.schlick_share(cosine, ior)
    # The table has no total reflection. A lobe picked with a too small probability would make fireflies.
    reflected = fresnel.towards_white(f0, energy.schlick_albedo(roughness, cosine, ior) if ior >= F(1) else share)
    refracted = subtract((F(1), F(1), F(1)), fresnel.towards_white(f0, share))
    albedo = add(multiply(reflected, tints[0]), multiply(refracted, tints[1]))
    write(lobes, k, GLASS, _spread(ior, alpha), point, n, scale(weight, gain), multiply(weight, albedo))
    _interface(lobes, k, ior, alpha)
    put(lobes, k, F0, f0)
    put(lobes, k, REFLECTION_TINT, tints[0])
    put(lobes, k, TRANSMISSION_TINT, tints[1])


@part
def setup_refraction(lobes, k, point, n, color, ior, alpha):
    """Write refraction alone as row k. It transmits all light; where there is total reflection it scatters nothing."""
    write(lobes, k, REFRACTION, _spread(ior, alpha), point, n, color, color)
    _interface(lobes, k, ior, alpha)


@part
def _shares(lobes, k, cosine):
    """Reflectance and transmittance of a microfacet, RGB each."""
    ior = lobes[k, IOR]
    if lobes[k, KIND] == REFRACTION:
        t = F(1) if fresnel.refracted_cosine(cosine, ior) > F(0) else F(0)
        return (F(0), F(0), F(0)), (t, t, t)
    r = fresnel.towards_white(get(lobes, k, F0), fresnel.schlick_share(cosine, ior))
    t = subtract((F(1), F(1), F(1)), r)
    return multiply(r, get(lobes, k, REFLECTION_TINT)), multiply(t, get(lobes, k, TRANSMISSION_TINT))


@part
def _reflecting(reflected, transmitted):
    """The probability of sampling a reflection: r / (r + t), with r and t the means over the channels."""
    r, t = (reflected[0] + reflected[1] + reflected[2]) * _THIRD, (transmitted[0] + transmitted[1] + transmitted[2]) * _THIRD
    return r / (r + t) if r + t > F(0) else F(1)


@part
def _bent(wo, h, ior):
    """The direction of the refracted ray."""
    cosine = dot(wo, h)
    return subtract(scale(h, cosine / ior - fresnel.refracted_cosine(cosine, ior)), scale(wo, F(1) / ior))


@part
def _half(wo, wi, n, ior, refracts):
    """(h, (wo.h) |dh / dwi|). h: upper normal of the microfacet that sends wo to wi. The second number is 0 without such an h."""
    if not refracts:
        return normalize(add(wo, wi)), F(0.25)
    h = scale(add(scale(wi, ior), wo), F(-1))
    length2 = dot(h, h)
    h = normalize(h) if dot(h, n) > F(0) else scale(normalize(h), F(-1))
    cos_o, cos_i = dot(wo, h), dot(wi, h)
    return h, -ior * ior / length2 * cos_o * cos_i if cos_o > F(0) and cos_i < F(0) else F(0)


@part
def evaluate(lobes, k, wo, wi):
    """(f |cos|, RGB; the density of `sample`). wo must be on the upper side of the lobe's normal."""
    n, ior, alpha2 = get(lobes, k, NORMAL), lobes[k, IOR], lobes[k, ALPHA_X] * lobes[k, ALPHA_X]
    cos_o, cos_i = dot(n, wo), dot(n, wi)
    refracts = cos_i < F(0)
    h, jacobian = _half(wo, wi, n, ior, refracts)
    if jacobian == F(0):
        return (F(0), F(0), F(0)), F(0)
    reflected, transmitted = _shares(lobes, k, dot(wo, h))
    across, along, shadow_o = cross(n, h), dot(n, h), smith(alpha2, cos_o)
    common = distribution(alpha2, dot(across, across), along * along) / cos_o * jacobian
    p = _reflecting(reflected, transmitted)
    share = transmitted if refracts else reflected
    f = scale(multiply(share, get(lobes, k, WEIGHT)), common / (F(1) + shadow_o + smith(alpha2, cos_i)))
    return f, common / (F(1) + shadow_o) * (F(1) - p if refracts else p)


@part
def sample(lobes, k, wo, u, v, w):
    """(direction wi, whether wi is refracted). wi may be on the wrong side of the lobe's normal; the lobe is 0 there."""
    h = half_vector(lobes, k, wo, u, v)
    reflected, transmitted = _shares(lobes, k, dot(wo, h))
    if w < _reflecting(reflected, transmitted):
        return mirrored(wo, h), False
    return _bent(wo, h, lobes[k, IOR]), True


@part
def singular(lobes, k, wo, refracts):
    """(Throughput of the reflected or refracted direction, RGB) / (probability of choosing this direction)."""
    reflected, transmitted = _shares(lobes, k, dot(get(lobes, k, NORMAL), wo))
    p = _reflecting(reflected, transmitted)
    share = scale(transmitted, F(1) / (F(1) - p)) if refracts else scale(reflected, F(1) / p)
    return multiply(share, get(lobes, k, WEIGHT))
