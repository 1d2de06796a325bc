"""A surface as the tracer sees it: emission, transparency and lobes. This module evaluates and samples the lobes.

`lobes` is a scratch array of (LOBES, COLUMNS) float32. Lobes beyond LOBES - 1 are left out, as in Cycles. `ng` is the geometric normal
on wo's side. `sample` reflects only to wo's side of both ng and the lobe's normal, and transmits only to the other side of both. For f,
`evaluate` tests only the lobe's normal, as in Cycles. With ng, the triangles of smooth surfaces would show at the terminator.
"""

import numpy as np

from ..kernels import part
from ..kernels.sampling import F, add, dot, scale
from ..scene import ray_kinds
from . import diffuse, glass, glossy, oren_nayar, sheen, translucent
from .lobe import (
    ALBEDO,
    BUMPED,
    COLUMNS,
    DIFFUSE,
    GLASS,
    GLOSSY,
    KIND,
    LOBES,
    NORMAL,
    OREN_NAYAR,
    PROBABILITY,
    REFRACTION,
    ROUGH_REFLECTION,
    SHEEN,
    SINGLE,
    SPREAD,
    TRANSLUCENT,
    WEIGHT,
    get,
)
from .normals import bump_shadowing, leaks
from .scatter import emission, scatter, scatter_plain, transparency

__all__ = [
    "COLUMNS",
    "LOBES",
    "SINGULAR",
    "albedo",
    "chance",
    "chance_within",
    "emission",
    "evaluate",
    "evaluate_seen",
    "is_within",
    "pick",
    "reflection",
    "sample",
    "scatter",
    "scatter_plain",
    "singular",
    "spreads",
    "transparency",
]

SINGULAR = 64  # in labels, beside the kind of ray: the direction comes from a delta function and has no density

_BLACK = (F(0), F(0), F(0))
_R_DIFFUSE, _R_GLOSSY, _R_TRANSMISSION, _R_TRANSLUCENT = ray_kinds.DIFFUSE, ray_kinds.GLOSSY, ray_kinds.TRANSMISSION, ray_kinds.TRANSLUCENT
_THROUGH = _R_TRANSMISSION | _R_TRANSLUCENT
_ANY = np.int64(_R_DIFFUSE | _R_GLOSSY | _THROUGH)


@part
def albedo(lobes, count):
    """An estimate of the share of light from wo that the lobes scatter, RGB."""
    total = _BLACK
    for k in range(count):
        total = add(total, get(lobes, k, ALBEDO))
    return total


# --- evaluating ------------------------------------------------------------------------------------------------------


@part
def evaluate(lobes, count, ng, wo, wi, reach):
    """(f |cos|, RGB; the density of wi by `pick` and `sample`; the part of this density from lobes within `reach`).

    Singular lobes are left out of all three.
    """
    return _evaluate_all(lobes, count, ng, wo, wi, reach, _ANY, False)


@part
def evaluate_seen(lobes, count, ng, wo, wi, reach, seen_by):
    """`evaluate` for a light that only the kinds of rays `seen_by` see: f includes only lobes that make such rays.

    The densities include directions that `sample` rejects because they cross the triangle. So light sampling gets a smaller MIS weight
    there, as in Cycles. Otherwise a light that nearly touches a smooth surface, or is a part of this surface, would make fireflies.
    """
    return _evaluate_all(lobes, count, ng, wo, wi, reach, seen_by, True)


@part
def _evaluate_all(lobes, count, ng, wo, wi, reach, seen_by, crossing):
    f, pdf, pdf_within = _BLACK, F(0), F(0)
    reflected = dot(ng, wi) > F(0)
    if count == 1 and lobes[0, KIND] == DIFFUSE and lobes[0, BUMPED] == F(0) and seen_by & _R_DIFFUSE:  # fast path for most surfaces
        cosine = diffuse.pdf(lobes, 0, wi)
        pdf = cosine if reflected or crossing else F(0)
        return scale(get(lobes, 0, WEIGHT), cosine), pdf, pdf if is_within(lobes, 0, reach) else F(0)
    for k in range(count):
        above = dot(get(lobes, k, NORMAL), wi) > F(0)
        if lobes[k, SPREAD] != SINGLE:
            lobe_f, lobe_pdf = _evaluate(lobes, k, above, wo, wi)
            f = add(f, lobe_f) if seen_by & _ray_kind(lobes[k, KIND], above) else f
            lobe_pdf *= lobes[k, PROBABILITY] if crossing or above == reflected else F(0)
            pdf += lobe_pdf
            if is_within(lobes, k, reach):
                pdf_within += lobe_pdf
    return f, pdf, pdf_within


@part
def _ray_kind(which, reflected):
    if which < TRANSLUCENT:
        return _R_DIFFUSE
    if which == TRANSLUCENT:
        return _R_TRANSLUCENT
    return _R_GLOSSY if reflected else _R_TRANSMISSION


@part
def _evaluate(lobes, k, reflected, wo, wi):
    """f |cos| and density of one lobe; `reflected` says whether wi is on the side of the lobe's normal."""
    which = lobes[k, KIND]
    if reflected and which <= SHEEN:
        return _evaluate_diffuse(lobes, k, which, wo, wi)
    if not reflected and which == TRANSLUCENT:
        return scale(translucent.evaluate(lobes, k, wi), _softening(lobes, k, wi)), translucent.pdf(lobes, k, wi)
    possible = which == GLASS or (which == GLOSSY and reflected) or (which == REFRACTION and not reflected)
    if not possible or dot(get(lobes, k, NORMAL), wo) <= F(0):
        return _BLACK, F(0)
    f, pdf = glossy.evaluate(lobes, k, wo, wi) if which == GLOSSY else glass.evaluate(lobes, k, wo, wi)
    return _BLACK if lobes[k, BUMPED] != F(0) and leaks(lobes, k, wi) else f, pdf


@part
def _evaluate_diffuse(lobes, k, which, wo, wi):
    if which == DIFFUSE:
        f, pdf = diffuse.evaluate(lobes, k, wi), diffuse.pdf(lobes, k, wi)
    elif which == OREN_NAYAR:
        f, pdf = oren_nayar.evaluate(lobes, k, wo, wi), diffuse.pdf(lobes, k, wi)
    else:
        f, pdf = sheen.evaluate(lobes, k, wi), sheen.pdf(lobes, k, wi)
    return scale(f, _softening(lobes, k, wi)), pdf


@part
def _softening(lobes, k, wi):
    return bump_shadowing(lobes, k, wi) if lobes[k, BUMPED] != F(0) else F(1)


# --- sampling --------------------------------------------------------------------------------------------------------


@part
def chance_within(lobes, count, reach):
    """The probability that `pick` takes a lobe within `reach`. reach: a sum of ways to spread light."""
    total = F(0)
    for k in range(count):
        if is_within(lobes, k, reach):
            total += lobes[k, PROBABILITY]
    return total


@part
def is_within(lobes, k, reach):
    """Whether lobe k spreads light in one of the ways of `reach`."""
    return np.int64(lobes[k, SPREAD]) & reach != 0


@part
def reflection(lobes, k, reach):
    """The kind of ray that lobe k reflects; the lobe must be within `reach`. If glossy lobes are out of reach, this is a constant."""
    return _R_GLOSSY if reach & np.int64(ROUGH_REFLECTION) and lobes[k, KIND] == GLOSSY else _R_DIFFUSE


@part
def spreads(lobes, count):
    """Whether any lobe is not singular. Light sampling can find light only then."""
    k = 0
    while k < count and lobes[k, SPREAD] == SINGLE:
        k += 1
    return k < count


@part
def chance(lobes, k):
    """The probability that `pick` takes lobe k."""
    return lobes[k, PROBABILITY]


@part
def pick(lobes, count, u):
    """(k, rest): `pick` takes lobe k with its probability, and rescales u in [0, 1) to the uniform number rest. There must be a lobe."""
    k = 0
    while k < count - 1 and u >= lobes[k, PROBABILITY]:
        u -= lobes[k, PROBABILITY]
        k += 1
    return k, min(u / lobes[k, PROBABILITY], F(1 - 2**-24))


@part
def sample(lobes, k, ng, wo, u, v, w):
    """(wi, label): a direction wi that lobe k draws with three uniform numbers. The label is the kind of ray, plus SINGULAR if it applies.

    The label is 0 if the sample fails. Then wi has no meaning, and the path ends.
    """
    which = lobes[k, KIND]
    if which <= OREN_NAYAR:
        wi, label = diffuse.sample(lobes, k, u, v), _R_DIFFUSE
    elif which == SHEEN:
        wi, label = sheen.sample(lobes, k, u, v), _R_DIFFUSE
    elif which == TRANSLUCENT:
        wi, label = translucent.sample(lobes, k, u, v), _R_TRANSLUCENT
    else:
        wi, label = _sample_microfacet(lobes, k, which, wo, u, v, w)
    reflected = (label & _THROUGH) == 0
    valid = (dot(ng, wi) > F(0)) == reflected and (dot(get(lobes, k, NORMAL), wi) > F(0)) == reflected
    return wi, label if valid else 0


@part
def _sample_microfacet(lobes, k, which, wo, u, v, w):
    singular = SINGULAR if lobes[k, SPREAD] == SINGLE else 0
    if dot(get(lobes, k, NORMAL), wo) <= F(0):
        return wo, 0
    if which == GLOSSY:
        return glossy.sample(lobes, k, wo, u, v), _R_GLOSSY | singular
    wi, refracted = glass.sample(lobes, k, wo, u, v, w)
    if refracted:
        return wi, _R_TRANSMISSION | singular
    return wi, 0 if which == REFRACTION else _R_GLOSSY | singular


@part
def singular(lobes, k, ng, wo, wi, label):
    """Throughput of a sample labelled SINGULAR, RGB: f |cos| / pdf of the lobe alone, not divided by the lobe's probability."""
    if lobes[k, KIND] == GLOSSY:
        return glossy.singular(lobes, k, wo)
    return glass.singular(lobes, k, wo, (label & _R_TRANSMISSION) != 0)
