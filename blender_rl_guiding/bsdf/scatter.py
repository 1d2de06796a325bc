"""The lobes, the emission and the transparency of a shader's closures."""

import numpy as np

from ..kernels import part
from ..kernels.sampling import F, add, luminance
from . import closures, principled
from .inputs import columns, gather, kind
from .lobe import ALBEDO, BUMPED, DIFFUSE, KIND, NORMAL, PROBABILITY, WEIGHT, put
from .lobe import SINGULAR as IS_SINGULAR

_BLACK = (F(0), F(0), F(0))
_TRANSPARENT = columns("transparent")
_K_DIFFUSE, _K_TRANSLUCENT, _K_TRANSPARENT, _K_EMISSION = kind("diffuse"), kind("translucent"), kind("transparent"), kind("emission")
_K_GLOSSY, _K_METALLIC, _K_GLASS, _K_REFRACTION = kind("glossy"), kind("metallic"), kind("glass"), kind("refraction")
_K_PRINCIPLED = kind("principled")


@part
def scatter(shading, shader, point, registers, lobes):
    """Write the lobes of a shader whose code has run; returns their number, emission and transparency.

    Emission is radiance towards wo, RGB; transparency the share of light that passes straight on, RGB. The lobes' probabilities
    are proportional to the luminance of their albedos.
    """
    count, emitted, passing = np.int64(0), _BLACK, _BLACK  # np.int64: Numba would compile all lobes once more for a literal
    for row in range(shading.shaders[shader, 2], shading.shaders[shader, 3]):
        which, inputs = shading.closures[row, 0], gather(shading, registers, row)
        if which == _K_DIFFUSE:
            count = closures.add_diffuse(inputs, point, lobes, count)
        elif which == _K_PRINCIPLED:
            count = principled.add_principled(inputs, point, lobes, count)
            emitted = add(emitted, principled.emission(inputs, point))
            passing = add(passing, principled.transparency(inputs))
        elif which == _K_EMISSION:
            emitted = add(emitted, closures.emission(inputs))
        elif which == _K_TRANSPARENT:
            passing = add(passing, closures.tinted_weight(inputs, _TRANSPARENT.color))
        else:
            count = _add(which, inputs, point, lobes, count)
    _normalize(lobes, count)
    return count, emitted, passing


@part
def scatter_plain(color, n, lobes):
    """`scatter` for a constant Lambert, the most frequent surface: one short way."""
    lobes[0, KIND], lobes[0, PROBABILITY], lobes[0, IS_SINGULAR], lobes[0, BUMPED] = DIFFUSE, F(1), F(0), F(0)
    put(lobes, 0, NORMAL, n)
    put(lobes, 0, WEIGHT, color)
    put(lobes, 0, ALBEDO, color)
    return np.int64(luminance(color) > F(0))


@part
def _add(which, inputs, point, lobes, count):
    """Write the lobes of one of the rarer closures; returns the new number of lobes."""
    if which == _K_GLOSSY:
        return closures.add_glossy(inputs, point, lobes, count)
    if which == _K_METALLIC:
        return closures.add_metallic(inputs, point, lobes, count)
    if which == _K_GLASS:
        return closures.add_glass(inputs, point, lobes, count)
    if which == _K_REFRACTION:
        return closures.add_refraction(inputs, point, lobes, count)
    if which == _K_TRANSLUCENT:
        return closures.add_translucent(inputs, point, lobes, count)
    return closures.add_sheen(inputs, point, lobes, count)


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
            inputs = gather(shading, registers, row)
            total = add(total, closures.emission(inputs))
        elif which == _K_PRINCIPLED:
            inputs = gather(shading, registers, row)
            total = add(total, principled.emission(inputs, point))
    return total


@part
def transparency(shading, shader, point, registers):
    """The share of light that passes straight on, RGB."""
    total = _BLACK
    for row in range(shading.shaders[shader, 2], shading.shaders[shader, 3]):
        which = shading.closures[row, 0]
        if which == _K_TRANSPARENT:
            inputs = gather(shading, registers, row)
            total = add(total, closures.tinted_weight(inputs, _TRANSPARENT.color))
        elif which == _K_PRINCIPLED:
            inputs = gather(shading, registers, row)
            total = add(total, principled.transparency(inputs))
    return total
