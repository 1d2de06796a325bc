"""What the tracer asks of a surface: its emission, its transparency and its lobes, and to evaluate and sample these.

`lobes` is a scratch array of (LOBES, COLUMNS) float32. Of more than LOBES - 1 lobes the last ones are left out, as in Cycles. `ng` is the
geometric normal on wo's side. Samples are reflected only to wo's side of both it and the lobe's normal, and transmitted only to
the other side of both. As in Cycles, this is not so of `evaluate`, where only the lobe's normal counts, or the triangles of smooth
surfaces would show at the terminator.
"""

import numpy as np

from ..kernels import part
from ..sampling import F, add, dot, luminance, scale
from ..scene import description
from . import closures, diffuse, glass, glossy, oren_nayar, principled, sheen, translucent
from .inputs import columns, gather, kind
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
    SHEEN,
    TRANSLUCENT,
    WEIGHT,
    get,
    put,
)
from .lobe import SINGULAR as IS_SINGULAR
from .normals import bump_shadowing, leaks

__all__ = [
    "COLUMNS",
    "LOBES",
    "SINGULAR",
    "albedo",
    "chance",
    "emission",
    "evaluate",
    "evaluate_seen",
    "guidable",
    "is_guidable",
    "pick",
    "sample",
    "scatter",
    "scatter_plain",
    "singular",
    "spreads",
    "transparency",
]

SINGULAR = 64  # in labels, beside the kinds of rays: the direction is the only one, and has no density

_BLACK = (F(0), F(0), F(0))
_TRANSPARENT = columns("transparent")
_K_DIFFUSE, _K_TRANSLUCENT, _K_TRANSPARENT, _K_EMISSION = kind("diffuse"), kind("translucent"), kind("transparent"), kind("emission")
_K_GLOSSY, _K_METALLIC, _K_GLASS, _K_REFRACTION = kind("glossy"), kind("metallic"), kind("glass"), kind("refraction")
_K_PRINCIPLED = kind("principled")
_R_DIFFUSE, _R_GLOSSY, _R_TRANSMISSION = description.DIFFUSE, description.GLOSSY, description.TRANSMISSION


# --- from closures to lobes ------------------------------------------------------------------------------------------


@part
def scatter(shading, shader, point, registers, lobes):
    """Write the lobes of a shader whose code has run; returns their number, emission and transparency.

    Emission is radiance towards wo, RGB; transparency the share of light that passes straight on, RGB. The lobes' probabilities
    are proportional to the luminance of their albedos.
    """
    count, emitted, passing = np.int64(0), _BLACK, _BLACK  # not a literal, for which all lobes would be compiled once more
    for row in range(shading.shaders[shader, 2], shading.shaders[shader, 3]):
        which = gather(shading, registers, row)
        if which == _K_DIFFUSE:
            count = closures.add_diffuse(registers, point, lobes, count)
        elif which == _K_PRINCIPLED:
            count = principled.add_principled(registers, point, lobes, count)
            emitted = add(emitted, principled.emission(registers, point))
            passing = add(passing, principled.transparency(registers))
        elif which == _K_EMISSION:
            emitted = add(emitted, closures.emission(registers))
        elif which == _K_TRANSPARENT:
            passing = add(passing, closures.tinted_weight(registers, _TRANSPARENT.color))
        else:
            count = _add(which, registers, point, lobes, count)
    _normalize(lobes, count)
    return count, emitted, passing


@part
def scatter_plain(color, n, lobes):
    """`scatter` for a constant Lambert: most surfaces, without the detours."""
    lobes[0, KIND], lobes[0, PROBABILITY], lobes[0, IS_SINGULAR], lobes[0, BUMPED] = DIFFUSE, F(1), F(0), F(0)
    put(lobes, 0, NORMAL, n)
    put(lobes, 0, WEIGHT, color)
    put(lobes, 0, ALBEDO, color)
    return np.int64(luminance(color) > F(0))


@part
def _add(which, registers, point, lobes, count):
    """Write the lobes of one of the rarer closures; returns the new number of lobes."""
    if which == _K_GLOSSY:
        return closures.add_glossy(registers, point, lobes, count)
    if which == _K_METALLIC:
        return closures.add_metallic(registers, point, lobes, count)
    if which == _K_GLASS:
        return closures.add_glass(registers, point, lobes, count)
    if which == _K_REFRACTION:
        return closures.add_refraction(registers, point, lobes, count)
    if which == _K_TRANSLUCENT:
        return closures.add_translucent(registers, point, lobes, count)
    return closures.add_sheen(registers, point, lobes, count)


@part
def _normalize(lobes, count):
    """Make the lobes' probabilities sum to 1."""
    if count == 1:
        lobes[0, PROBABILITY] = F(1)
        return
    total = F(0)
    for k in range(count):
        total += lobes[k, PROBABILITY]
    for k in range(count):
        lobes[k, PROBABILITY] /= total


@part
def emission(shading, shader, point, registers):
    """Radiance towards wo, RGB; also that of the world."""
    total = _BLACK
    for row in range(shading.shaders[shader, 2], shading.shaders[shader, 3]):
        which = shading.closures[row, 0]
        if which == _K_EMISSION:
            gather(shading, registers, row)
            total = add(total, closures.emission(registers))
        elif which == _K_PRINCIPLED:
            gather(shading, registers, row)
            total = add(total, principled.emission(registers, point))
    return total


@part
def transparency(shading, shader, point, registers):
    """The share of light that passes straight on, RGB."""
    total = _BLACK
    for row in range(shading.shaders[shader, 2], shading.shaders[shader, 3]):
        which = shading.closures[row, 0]
        if which == _K_TRANSPARENT:
            gather(shading, registers, row)
            total = add(total, closures.tinted_weight(registers, _TRANSPARENT.color))
        elif which == _K_PRINCIPLED:
            gather(shading, registers, row)
            total = add(total, principled.transparency(registers))
    return total


@part
def albedo(lobes, count):
    """An estimate of the share of light from wo that the lobes scatter, RGB."""
    total = _BLACK
    for k in range(count):
        total = add(total, get(lobes, k, ALBEDO))
    return total


# --- evaluating ------------------------------------------------------------------------------------------------------


@part
def evaluate(lobes, count, ng, wo, wi):
    """f |cos|, RGB, the density with which `pick` and `sample` choose wi, and the part of it that is `guidable`.

    Singular lobes are left out of all three.
    """
    return evaluate_seen(lobes, count, ng, wo, wi, np.int64(description.VISIBLE))


@part
def evaluate_seen(lobes, count, ng, wo, wi, seen_by):
    """`evaluate`, with f from those lobes only that make one of the kinds of rays `seen_by`."""
    f, pdf, guidable_pdf = _BLACK, F(0), F(0)
    reflected = dot(ng, wi) > F(0)
    if count == 1 and lobes[0, KIND] == DIFFUSE and lobes[0, BUMPED] == F(0) and seen_by & _R_DIFFUSE:  # most surfaces, without the detours
        cosine = diffuse.pdf(lobes, 0, wi)
        pdf = cosine if reflected else F(0)
        return scale(get(lobes, 0, WEIGHT), cosine), pdf, pdf
    for k in range(count):
        above = dot(get(lobes, k, NORMAL), wi) > F(0)
        if lobes[k, IS_SINGULAR] == F(0):
            lobe_f, lobe_pdf = _evaluate(lobes, k, above, wo, wi)
            f = add(f, lobe_f) if seen_by & _ray_kind(lobes[k, KIND]) else f
            lobe_pdf *= lobes[k, PROBABILITY] if above == reflected else F(0)
            pdf += lobe_pdf
            if lobes[k, KIND] <= OREN_NAYAR:
                guidable_pdf += lobe_pdf
    return f, pdf, guidable_pdf


@part
def _ray_kind(which):
    if which <= TRANSLUCENT:
        return _R_DIFFUSE
    return _R_GLOSSY if which == GLOSSY else _R_TRANSMISSION


@part
def _evaluate(lobes, k, reflected, wo, wi):
    """f |cos| and density of one lobe, where wi is `reflected` if it is on the side of the lobe's normal."""
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
def guidable(lobes, count):
    """The probability that a lobe is picked whose directions are drawn by the cosine on wo's side."""
    total = F(0)
    for k in range(count):
        if lobes[k, KIND] <= OREN_NAYAR:
            total += lobes[k, PROBABILITY]
    return total


@part
def is_guidable(lobes, k):
    """Whether `guidable` counts lobe k."""
    return lobes[k, KIND] <= OREN_NAYAR


@part
def spreads(lobes, count):
    """Whether any lobe scatters into more than single directions, so that looking for lights may find some."""
    k = 0
    while k < count and lobes[k, IS_SINGULAR] != F(0):
        k += 1
    return k < count


@part
def chance(lobes, k):
    """The probability with which `pick` takes lobe k."""
    return lobes[k, PROBABILITY]


@part
def pick(lobes, count, u):
    """A lobe by its probability, and the number u in [0, 1) made uniform anew. There has to be a lobe."""
    k = 0
    while k < count - 1 and u >= lobes[k, PROBABILITY]:
        u -= lobes[k, PROBABILITY]
        k += 1
    return k, min(u / lobes[k, PROBABILITY], F(1 - 2**-24))


@part
def sample(lobes, k, ng, wo, u, v, w):
    """A direction wi from lobe k, by three uniform numbers, and its label: the kinds of ray it makes, and SINGULAR.

    The label is 0 where the sample has failed: wi is of no use then, and the path ends.
    """
    which = lobes[k, KIND]
    if which <= OREN_NAYAR:
        wi, label = diffuse.sample(lobes, k, u, v), _R_DIFFUSE
    elif which == SHEEN:
        wi, label = sheen.sample(lobes, k, u, v), _R_DIFFUSE
    elif which == TRANSLUCENT:
        wi, label = translucent.sample(lobes, k, u, v), _R_DIFFUSE | _R_TRANSMISSION
    else:
        wi, label = _sample_microfacet(lobes, k, which, wo, u, v, w)
    reflected = (label & _R_TRANSMISSION) == 0
    valid = (dot(ng, wi) > F(0)) == reflected and (dot(get(lobes, k, NORMAL), wi) > F(0)) == reflected
    return wi, label if valid else 0


@part
def _sample_microfacet(lobes, k, which, wo, u, v, w):
    label = _R_GLOSSY | (SINGULAR if lobes[k, IS_SINGULAR] != F(0) else 0)
    if dot(get(lobes, k, NORMAL), wo) <= F(0):
        return wo, 0
    if which == GLOSSY:
        return glossy.sample(lobes, k, wo, u, v), label
    wi, refracted = glass.sample(lobes, k, wo, u, v, w)
    if refracted:
        return wi, label | _R_TRANSMISSION
    return wi, 0 if which == REFRACTION else label


@part
def singular(lobes, k, ng, wo, wi, label):
    """Throughput of a sample labelled SINGULAR, RGB: f |cos| over the lobe's own density, not over its probability."""
    if lobes[k, KIND] == GLOSSY:
        return glossy.singular(lobes, k, wo)
    return glass.singular(lobes, k, wo, (label & _R_TRANSMISSION) != 0)
