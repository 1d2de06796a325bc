"""Vectors: the Vector Math and Mapping nodes.

A result that is not real is 0, as in Cycles.
"""

import math

from ..kernels import part
from ..kernels.sampling import F, add, dot, multiply, normalize, scale, subtract
from ..scene.ops import Mapping, VectorMath
from .arithmetic import divide, number_math

BY_COMPONENTS = VectorMath.TANGENT.value  # the last operation that Math has too, with the same number


@part
def cross(a, b):
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@part
def unit(a):
    """a / |a|; 0 for a = 0."""
    return normalize(a) if dot(a, a) > F(0) else a


@part
def refract(a, n, eta):
    """Direction a, refracted at a surface with unit normal n. eta: ior in front / ior behind. 0 for total reflection."""
    cosine = dot(n, a)
    k = F(1) - eta * eta * (F(1) - cosine * cosine)
    if k < F(0):
        return F(0), F(0), F(0)
    return subtract(scale(a, eta), scale(n, eta * cosine + math.sqrt(k)))


@part
def _vector(mode, a, b, c, factor):
    if mode == VectorMath.CROSS_PRODUCT:
        return cross(a, b)
    if mode == VectorMath.PROJECT:
        return scale(b, divide(dot(a, b), dot(b, b)))
    if mode == VectorMath.REFLECT:
        n = unit(b)
        return subtract(a, scale(n, F(2) * dot(a, n)))
    if mode == VectorMath.REFRACT:
        return refract(a, unit(b), factor)
    if mode == VectorMath.FACEFORWARD:
        return a if dot(c, b) < F(0) else scale(a, F(-1))
    if mode == VectorMath.SCALE:
        return scale(a, factor)
    return unit(a)


@part
def vector_math(mode, a, b, c, factor):
    """The Vector Math node. If the result is one number x, it is (x, x, x)."""
    if mode <= BY_COMPONENTS:
        return number_math(mode, a[0], b[0], c[0]), number_math(mode, a[1], b[1], c[1]), number_math(mode, a[2], b[2], c[2])
    if mode == VectorMath.DOT_PRODUCT:
        x = dot(a, b)
    elif mode == VectorMath.DISTANCE:
        d = subtract(a, b)
        x = math.sqrt(dot(d, d))
    elif mode == VectorMath.LENGTH:
        x = math.sqrt(dot(a, a))
    else:
        return _vector(mode, a, b, c, factor)
    return x, x, x


# --- coordinates -----------------------------------------------------------------------------------------------------


@part
def rotation(angles):
    """The columns of the matrix that rotates about x, then y, then z by `angles`, radians."""
    cx, cy, cz = math.cos(angles[0]), math.cos(angles[1]), math.cos(angles[2])
    sx, sy, sz = math.sin(angles[0]), math.sin(angles[1]), math.sin(angles[2])
    return (
        (cy * cz, cy * sz, -sy),
        (sy * sx * cz - cx * sz, sy * sx * sz + cx * cz, cy * sx),
        (sy * cx * cz + sx * sz, sy * cx * sz - sx * cz, cy * cx),
    )


@part
def combine(x, y, z, v):
    """v[0] x + v[1] y + v[2] z."""
    return add(add(scale(x, v[0]), scale(y, v[1])), scale(z, v[2]))


@part
def quotient(a, b):
    """a / b by components."""
    return divide(a[0], b[0]), divide(a[1], b[1]), divide(a[2], b[2])


@part
def mapping(mode, v, location, angles, factor):
    """The Mapping node."""
    x, y, z = rotation(angles)
    if mode == Mapping.TEXTURE:
        d = subtract(v, location)
        return quotient((dot(x, d), dot(y, d), dot(z, d)), factor)
    if mode == Mapping.NORMAL:
        return unit(combine(x, y, z, quotient(v, factor)))
    turned = combine(x, y, z, multiply(v, factor))
    return add(turned, location) if mode == Mapping.POINT else turned
