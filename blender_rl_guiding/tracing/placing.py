"""From the space of an instance's mesh to the world, at a hit: points, normals and, the other way, steps along the surface.

`matrices` is (I, 3, 4) float32, `instance_to_world` of the scene.
"""

import math

from ..kernels import part
from ..kernels.sampling import F, cross, dot, normalize, scale


@part
def point_to_world(matrices, i, p):
    """A point of instance i's mesh in the world."""
    m = matrices[i]
    return (
        m[0, 0] * p[0] + m[0, 1] * p[1] + m[0, 2] * p[2] + m[0, 3],
        m[1, 0] * p[0] + m[1, 1] * p[1] + m[1, 2] * p[2] + m[1, 3],
        m[2, 0] * p[0] + m[2, 1] * p[1] + m[2, 2] * p[2] + m[2, 3],
    )


@part
def placing_error(matrices, i, p, error):
    """How far a point p of instance i's mesh in the world, and what Embree takes for it, may lie apart by rounding.

    `error` is a bound in the mesh's space. Embree brings the rays there: on the way there and back, products of the matrix cancel
    against its shift. That was found to cost less than 2^-22 times the sum of their sizes, whatever the matrix; it is doubled as
    `geometry.measure` does.
    """
    m, size, squares = matrices[i], F(0), F(0)
    for row in range(3):
        size += abs(m[row, 0] * p[0]) + abs(m[row, 1] * p[1]) + abs(m[row, 2] * p[2]) + abs(m[row, 3])
        squares += m[row, 0] * m[row, 0] + m[row, 1] * m[row, 1] + m[row, 2] * m[row, 2]
    return F(2**-21) * size + error * math.sqrt(squares)


@part
def normal_to_world(matrices, i, n):
    """A normal of instance i's mesh in the world, unit: the inverse transpose of its matrix A is cofactors(A) / det A."""
    a, b, c = _rows(matrices, i)
    x, y, z = cross(b, c), cross(c, a), cross(a, b)
    turned = dot(x, n), dot(y, n), dot(z, n)
    return normalize(turned if dot(a, x) > F(0) else scale(turned, F(-1)))


@part
def step_to_mesh(matrices, i, d):
    """A difference of points in the world, in the space of instance i's mesh."""
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
    """The rows of the left 3 x 3."""
    m = matrices[i]
    return (m[0, 0], m[0, 1], m[0, 2]), (m[1, 0], m[1, 1], m[1, 2]), (m[2, 0], m[2, 1], m[2, 2])
