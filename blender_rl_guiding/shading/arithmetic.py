"""Numbers: the Math, Clamp and Map Range nodes.

A result that is not real (a / 0, the root of a negative number) is 0, as in Cycles.
"""

import math

import numpy as np

from ..kernels import part
from ..kernels.sampling import PI, F
from ..scene.ops import Clamp, Ease, Math

ROUNDING, CURVES, ANGLES = Math.ROUND.value, Math.TRUNC.value, Math.LOGARITHM.value  # first operation of each group
EPSILON = F(2**-23)


# --- numbers ---------------------------------------------------------------------------------------------------------


@part
def divide(a, b):
    """a / b; 0 if b is 0."""
    return a / b if b != F(0) else F(0)


@part
def saturate(a):
    """a clamped to 0..1."""
    return min(max(a, F(0)), F(1))


@part
def lerp(a, b, t):
    """a + t (b - a)."""
    return a + t * (b - a)


@part
def sign(a):
    """-1, 0 or 1."""
    return F(a > F(0)) - F(a < F(0))


@part
def power(a, b):
    """a^b; 0 if a is negative and b is not whole."""
    if a < F(0) and b != np.floor(b):
        return F(0)
    return a**b


@part
def wrap(a, high, low):
    """a + k (high - low), with the whole number k that puts the result in low..high; low if high = low."""
    width = high - low
    return a - width * np.floor((a - low) / width) if width != F(0) else low


@part
def ping_pong(a, b):
    """A triangle wave between 0 and b; its value at a = 0 is 0."""
    if b == F(0):
        return F(0)
    t = (a - b) / (b * F(2))
    return abs((t - np.floor(t)) * b * F(2) - b)


@part
def smooth_minimum(a, b, width):
    """min(a, b) with its corner rounded over `width`."""
    if width == F(0):
        return min(a, b)
    h = max(width - abs(a - b), F(0)) / width
    return min(a, b) - h * h * h * width * F(1 / 6)


@part
def logarithm(a, base):
    """log(a) / log(base); 0 if a or base has no logarithm."""
    if a <= F(0) or base <= F(0):
        return F(0)
    return divide(math.log(a), math.log(base))


@part
def _basic(mode, a, b, c):
    if mode == Math.ADD:
        return a + b
    if mode == Math.SUBTRACT:
        return a - b
    if mode == Math.MULTIPLY:
        return a * b
    if mode == Math.DIVIDE:
        return divide(a, b)
    if mode == Math.MULTIPLY_ADD:
        return a * b + c
    if mode == Math.MINIMUM:
        return min(a, b)
    if mode == Math.MAXIMUM:
        return max(a, b)
    if mode == Math.ABSOLUTE:
        return abs(a)
    return sign(a)


@part
def _rounding(mode, a, b, c):
    if mode == Math.ROUND:
        return np.floor(a + F(0.5))
    if mode == Math.FLOOR:
        return np.floor(a)
    if mode == Math.CEIL:
        return np.ceil(a)
    if mode == Math.FRACT:
        return a - np.floor(a)
    if mode == Math.SNAP:
        return np.floor(divide(a, b)) * b
    if mode == Math.WRAP:
        return wrap(a, b, c)
    if mode == Math.MODULO:
        return np.fmod(a, b) if b != F(0) else F(0)
    if mode == Math.POWER:
        return power(a, b)
    if mode == Math.SINE:
        return math.sin(a)
    if mode == Math.COSINE:
        return math.cos(a)
    return math.tan(a)


@part
def _curves(mode, a, b, c):
    if mode == Math.TRUNC:
        return np.trunc(a)
    if mode == Math.FLOORED_MODULO:
        return a - np.floor(a / b) * b if b != F(0) else F(0)
    if mode == Math.PINGPONG:
        return ping_pong(a, b)
    if mode == Math.LESS_THAN:
        return F(a < b)
    if mode == Math.GREATER_THAN:
        return F(a > b)
    if mode == Math.COMPARE:
        return F(a == b or abs(a - b) <= max(c, EPSILON))
    if mode == Math.SMOOTH_MIN:
        return smooth_minimum(a, b, c)
    return -smooth_minimum(-a, -b, c)


@part
def _angles(mode, a, b):
    if mode == Math.ARCSINE:
        return math.asin(min(max(a, F(-1)), F(1)))
    if mode == Math.ARCCOSINE:
        return math.acos(min(max(a, F(-1)), F(1)))
    if mode == Math.ARCTANGENT:
        return math.atan(a)
    if mode == Math.ARCTAN2:
        return math.atan2(a, b)
    if mode == Math.SINH:
        return math.sinh(a)
    if mode == Math.COSH:
        return math.cosh(a)
    if mode == Math.TANH:
        return math.tanh(a)
    if mode == Math.RADIANS:
        return a * (PI / F(180))
    return a * (F(180) / PI)


@part
def _transcendental(mode, a, b):
    if mode == Math.LOGARITHM:
        return logarithm(a, b)
    if mode == Math.SQRT:
        return math.sqrt(max(a, F(0)))
    if mode == Math.INVERSE_SQRT:
        return F(1) / math.sqrt(a) if a > F(0) else F(0)
    if mode == Math.EXPONENT:
        return math.exp(a)
    return _angles(mode, a, b)


@part
def number_math(mode, a, b, c):
    """The Math node, before its clamp."""
    if mode < ROUNDING:
        return _basic(mode, a, b, c)
    if mode < CURVES:
        return _rounding(mode, a, b, c)
    if mode < ANGLES:
        return _curves(mode, a, b, c)
    return _transcendental(mode, a, b)


# --- ranges ----------------------------------------------------------------------------------------------------------


@part
def clamp(mode, a, low, high):
    """The Clamp node: RANGE takes the bounds in either order."""
    if mode == Clamp.RANGE and low > high:
        return min(max(a, high), low)
    return min(max(a, low), high)


@part
def ease(mode, t):
    """An easing curve from 0 to 1."""
    if mode == Ease.LINEAR:
        return t
    t = saturate(t)
    if mode == Ease.SMOOTHSTEP:
        return t * t * (F(3) - F(2) * t)
    return t * t * t * (t * (t * F(6) - F(15)) + F(10))


@part
def map_range(mode, clamped, a, from_low, from_high, to_low, to_high):
    """The Map Range node; 0 if from_high = from_low."""
    x = lerp(to_low, to_high, ease(mode, divide(a - from_low, from_high - from_low))) if from_low != from_high else F(0)
    return clamp(Clamp.RANGE.value, x, to_low, to_high) if clamped else x


@part
def map_ranges(mode, clamped, a, from_low, from_high, to_low, to_high):
    """The Map Range node by components."""
    return (
        map_range(mode, clamped, a[0], from_low[0], from_high[0], to_low[0], to_high[0]),
        map_range(mode, clamped, a[1], from_low[1], from_high[1], to_low[1], to_high[1]),
        map_range(mode, clamped, a[2], from_low[2], from_high[2], to_low[2], to_high[2]),
    )


@part
def stair(a, count):
    """floor(a (count + 1)) / count: stairs from 0 to 1."""
    return np.floor(a * (count + F(1))) / count if count > F(0) else F(0)


@part
def steps(a, count):
    """`stair` by components, for the type Stepped of Map Range."""
    return stair(a[0], count[0]), stair(a[1], count[1]), stair(a[2], count[2])
