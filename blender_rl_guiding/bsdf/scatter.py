"""The lobes, the emission and the transparency of a shader's closures."""

import numpy as np

from ..kernels import part
from ..kernels.sampling import F, add, luminance
from . import closures, principled
from .inputs import columns, gather, kind
from .lobe import ALBEDO, BUMPED, DIFFUSE, DIFFUSE_REFLECTION, KIND, NORMAL, PROBABILITY, SPREAD, WEIGHT, put

_BLACK = (F(0), F(0), F(0))
_TRANSPARENT = columns("transparent")
_K_DIFFUSE, _K_TRANSLUCENT, _K_TRANSPARENT, _K_EMISSION = kind("diffuse"), kind("translucent"), kind("transparent"), kind("emission")
_K_GLOSSY, _K_METALLIC, _K_GLASS, _K_REFRACTION = kind("glossy"), kind("metallic"), kind("glass"), kind("refraction")
_K_PRINCIPLED = kind("principled")


@part
def scatter(shading, shader, point, registers, lobes):
    """Write the lobes of a shader whose code has run. Returns (number of lobes, emission, transparency).

    emission: radiance towards wo, RGB. transparency: share of light that passes straight on, RGB. The probability of a lobe is
    proportional to the luminance of its albedo.
    """
    count, emitted, passing = np.int64(0), _BLACK, _BLACK  # np.int64: for a literal, Numba would compile all lobes again
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
    """A fast `scatter` for the most frequent surface: a Lambert reflection of constant colour."""
    lobes[0, KIND], lobes[0, PROBABILITY], lobes[0, SPREAD], lobes[0, BUMPED] = DIFFUSE, F(1), DIFFUSE_REFLECTION, F(0)
    put(lobes, 0, NORMAL, n)
    put(lobes, 0, WEIGHT, color)
    put(lobes, 0, ALBEDO, color)
    return np.int64(luminance(color) > F(0))


@part
def _add(which, inputs, point, lobes, count):
    """Write the lobes of one of the rarer closures. Returns the new number of lobes."""
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
    """Emitted radiance towards wo, RGB, of a surface or of the world."""
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
