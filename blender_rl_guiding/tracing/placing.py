"""Transforms at a hit on an instance: points and normals from mesh space to world space, steps from world space to mesh space.

`matrices` is (I, 3, 4) float32, `instance_to_world` of the scene. A is the left 3 x 3 of instance i's matrix.
"""

import math

from ..kernels import part
from ..kernels.sampling import F, cross, dot, normalize, scale


@part
def point_to_world(matrices, i, p):
    """The world position of point p of instance i's mesh."""
    m = matrices[i]
    return (
        m[0, 0] * p[0] + m[0, 1] * p[1] + m[0, 2] * p[2] + m[0, 3],
        m[1, 0] * p[0] + m[1, 1] * p[1] + m[1, 2] * p[2] + m[1, 3],
        m[2, 0] * p[0] + m[2, 1] * p[1] + m[2, 2] * p[2] + m[2, 3],
    )


@part
def placing_error(matrices, i, p, error):
    """A bound on the rounding between point p of instance i's mesh, in world space, and the point that Embree hits.

    error: the bound in mesh space. Embree transforms the ray to mesh space. In both directions, products of the matrix cancel against
    its translation. In tests of many matrices this cost less than 2^-22 times the sum of their sizes. The bound is twice that, as in
    `geometry.measure`.
    """
    m, size, squares = matrices[i], F(0), F(0)
    for row in range(3):
        size += abs(m[row, 0] * p[0]) + abs(m[row, 1] * p[1]) + abs(m[row, 2] * p[2]) + abs(m[row, 3])
        squares += m[row, 0] * m[row, 0] + m[row, 1] * m[row, 1] + m[row, 2] * m[row, 2]
    return F(2**-21) * size + error * math.sqrt(squares)


@part
def normal_to_world(matrices, i, n):
    """normalize(A^-T n), A^-T = cofactors(A) / det A: normal n of instance i's mesh, in world space."""
    a, b, c = _rows(matrices, i)
    x, y, z = cross(b, c), cross(c, a), cross(a, b)
    turned = dot(x, n), dot(y, n), dot(z, n)
    return normalize(turned if dot(a, x) > F(0) else scale(turned, F(-1)))


@part
def step_to_mesh(matrices, i, d):
    """A^-1 d: a vector d between two world points, in the space of instance i's mesh."""
    a, b, c = _rows(matrices, i)
    x, y, z = cross(b, c), cross(c, a), cross(a, b)
    over = F(1) / dot(a, x)
    return (
        (x[0] * d[0] + y[0] * d[1] + z[0] * d[2]) * over,
        (x[1] * d[0] + y[1] * d[1] + z[1] * d[2]) * over,
        (x[2] * d[0] + y[2] * d[1] + z[2] * d[2]) * over,
    )


@part
def _rows(matrices, i):
    """The rows of A."""
    m = matrices[i]
    return (m[0, 0], m[0, 1], m[0, 2]), (m[1, 0], m[1, 1], m[1, 2]), (m[2, 0], m[2, 1], m[2, 2])
