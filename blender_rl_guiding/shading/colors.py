"""Colours: the Mix node's blend types, colour models, and the nodes that adjust a colour."""

import numpy as np

from ..kernels import part
from ..kernels.sampling import F
from ..scene.ops import Blend, Space
from .arithmetic import divide, lerp, saturate

HUES = Blend.HUE.value  # the first blend type of `blend_hues`

# --- colour models ---------------------------------------------------------------------------------------------------


@part
def hue(c, high, delta):
    """The hue of colour c, in 0..1; `high` is its largest component, `delta` the largest minus the smallest."""
    if delta == F(0):
        return F(0)
    if c[0] == high:
        h = (c[1] - c[2]) / delta
    elif c[1] == high:
        h = F(2) + (c[2] - c[0]) / delta
    else:
        h = F(4) + (c[0] - c[1]) / delta
    return h / F(6) + F(h < F(0))


@part
def rgb_to_hsv(c):
    """Hue, saturation and value."""
    high, low = max(c[0], c[1], c[2]), min(c[0], c[1], c[2])
    return hue(c, high, high - low), divide(high - low, high), high


@part
def rgb_to_hsl(c):
    """Hue, saturation and lightness."""
    high, low = max(c[0], c[1], c[2]), min(c[0], c[1], c[2])
    delta, lightness = high - low, min((high + low) * F(0.5), F(1))
    return hue(c, high, delta), divide(delta, F(2) - high - low if lightness > F(0.5) else high + low), lightness


@part
def pure(h):
    """The fully saturated colour of a hue."""
    return (
        saturate(abs(h * F(6) - F(3)) - F(1)),
        saturate(F(2) - abs(h * F(6) - F(2))),
        saturate(F(2) - abs(h * F(6) - F(4))),
    )


@part
def hsv_to_rgb(c):
    """The colour of hue, saturation and value."""
    r, g, b = pure(c[0])
    return c[2] * lerp(F(1), r, c[1]), c[2] * lerp(F(1), g, c[1]), c[2] * lerp(F(1), b, c[1])


@part
def hsl_to_rgb(c):
    """The colour of hue, saturation and lightness."""
    r, g, b = pure(c[0])
    chroma = (F(1) - abs(F(2) * c[2] - F(1))) * c[1]
    return (r - F(0.5)) * chroma + c[2], (g - F(0.5)) * chroma + c[2], (b - F(0.5)) * chroma + c[2]


@part
def separate(space, c):
    """RGB c in the colour model `space`."""
    if space == Space.HSV:
        return rgb_to_hsv(c)
    return rgb_to_hsl(c) if space == Space.HSL else c


@part
def combine(space, c):
    """The RGB of c, which is in the colour model `space`."""
    if space == Space.HSV:
        return hsv_to_rgb(c)
    return hsl_to_rgb(c) if space == Space.HSL else c


# --- mixing ----------------------------------------------------------------------------------------------------------


@part
def full(mode, a, b):
    """The result at factor 1, for the blend types whose result is linear in the factor."""
    if mode == Blend.MIX:
        return b
    if mode == Blend.DARKEN:
        return min(a, b)
    if mode == Blend.MULTIPLY:
        return a * b
    if mode == Blend.LIGHTEN:
        return max(a, b)
    if mode == Blend.ADD:
        return a + b
    if mode == Blend.SUBTRACT:
        return a - b
    if mode == Blend.DIFFERENCE:
        return abs(a - b)
    if mode == Blend.DIVIDE:
        return a / b if b != F(0) else a
    if mode == Blend.SCREEN:
        return F(1) - (F(1) - a) * (F(1) - b)
    if mode == Blend.SOFT_LIGHT:
        return a * ((F(1) - a) * b + F(1) - (F(1) - a) * (F(1) - b))
    if mode == Blend.LINEAR_LIGHT:
        return a + F(2) * b - F(1)
    return F(2) * a * b if a < F(0.5) else F(1) - F(2) * (F(1) - a) * (F(1) - b)


@part
def blend(mode, t, a, b):
    """One component of the Mix node at factor t, for all blend types but those of `blend_hues`."""
    if mode == Blend.EXCLUSION:
        return max(lerp(a, a + b - F(2) * a * b, t), F(0))
    if mode == Blend.DODGE:
        rest = F(1) - t * b
        if a == F(0):
            return a
        return min(a / rest, F(1)) if rest > F(0) else F(1)
    if mode == Blend.BURN:
        rest = F(1) - t + t * b
        return saturate(F(1) - (F(1) - a) / rest) if rest > F(0) else F(0)
    return lerp(a, full(mode, a, b), t)


@part
def blend_hues(mode, t, a, b):
    """The blend types that take hue, saturation or value from b."""
    x, y = rgb_to_hsv(a), rgb_to_hsv(b)
    if mode == Blend.VALUE:
        return hsv_to_rgb((x[0], x[1], lerp(x[2], y[2], t)))
    if mode == Blend.SATURATION:
        return hsv_to_rgb((x[0], lerp(x[1], y[1], t), x[2])) if x[1] != F(0) else a
    if y[1] == F(0):
        return a
    c = hsv_to_rgb((y[0], x[1] if mode == Blend.HUE else y[1], x[2]))
    return lerp(a[0], c[0], t), lerp(a[1], c[1], t), lerp(a[2], c[2], t)


@part
def mix(mode, clamp_factor, clamp_result, t, a, b):
    """The Mix node. The factor t has a value for each component; `blend_hues` reads the first."""
    if clamp_factor:
        t = saturate(t[0]), saturate(t[1]), saturate(t[2])
    if mode >= HUES:
        c = blend_hues(mode, t[0], a, b)
    else:
        c = blend(mode, t[0], a[0], b[0]), blend(mode, t[1], a[1], b[1]), blend(mode, t[2], a[2], b[2])
    return (saturate(c[0]), saturate(c[1]), saturate(c[2])) if clamp_result else c


# --- adjusting -------------------------------------------------------------------------------------------------------


@part
def invert(t, c):
    """The Invert Color node."""
    return lerp(c[0], F(1) - c[0], t), lerp(c[1], F(1) - c[1], t), lerp(c[2], F(1) - c[2], t)


@part
def gamma(c, exponent):
    """The Gamma node. Components that are not positive stay as they are."""
    if exponent == F(0):
        return F(1), F(1), F(1)
    return (
        c[0] ** exponent if c[0] > F(0) else c[0],
        c[1] ** exponent if c[1] > F(0) else c[1],
        c[2] ** exponent if c[2] > F(0) else c[2],
    )


@part
def bright_contrast(c, bright, contrast):
    """The Brightness/Contrast node."""
    slope, offset = F(1) + contrast, bright - contrast * F(0.5)
    return max(slope * c[0] + offset, F(0)), max(slope * c[1] + offset, F(0)), max(slope * c[2] + offset, F(0))


@part
def hue_saturation_value(turn, saturation, value, t, c):
    """The Hue/Saturation/Value node."""
    h, s, v = rgb_to_hsv(c)
    h += turn + F(0.5)
    r, g, b = hsv_to_rgb((h - np.floor(h), saturate(s * saturation), v * value))
    return max(lerp(c[0], r, t), F(0)), max(lerp(c[1], g, t), F(0)), max(lerp(c[2], b, t), F(0))


@part
def grey(c):
    """(Y, Y, Y) with the luminance Y, by Cycles' digits of the Rec. 709 weights."""
    x = F(0.212639) * c[0] + F(0.715169) * c[1] + F(0.072192) * c[2]
    return x, x, x
