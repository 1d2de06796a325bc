"""Tangent frames of lobes that are not symmetric about their normal."""

import math

from ..kernels import part
from ..kernels.sampling import TWO_PI, F, add, cross, dot, normalize, scale, tangents


@part
def frame(n, tangent):
    """Tangent and bitangent of a right-handed frame around n. The tangent is `tangent`, projected; any one if that is zero or along n."""
    bitangent = cross(n, tangent)
    if dot(bitangent, bitangent) < F(1e-12):
        return tangents(n)
    bitangent = normalize(bitangent)
    return cross(bitangent, n), bitangent


@part
def turned(v, axis, turns):
    """v rotated by `turns` about the unit axis, right-handed (Rodrigues)."""
    if turns == F(0):
        return v
    c, s = math.cos(TWO_PI * turns), math.sin(TWO_PI * turns)
    return add(add(scale(v, c), scale(cross(axis, v), s)), scale(axis, dot(axis, v) * (F(1) - c)))
