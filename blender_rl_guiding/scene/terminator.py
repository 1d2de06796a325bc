"""Where shadow rays start on smooth surfaces, so that the triangles beneath do not show at the terminator.

A coarse mesh with smooth normals stands for a curved surface that bulges over its triangles. Light that grazes it would be cut off by
the triangles in steps: such a ray therefore starts on the curved surface. The rules are those of Cycles, with its default threshold.
"""

from ..kernels import part
from ..sampling import F, add, dot, normalize, scale, subtract, vector
from .geometry import off_surface

GRAZING = F(0.1)  # cosine below which rays start further up


@part
def shadow_ray(surface, triangle, u, v, x, n, ng, wi, distance, travelled):
    """A ray to what lies at `distance` along wi from just above x: its origin, unit direction and distance.

    x is at barycentrics u, v of a triangle and was hit at the distance `travelled`; `n` and `ng` are on its upper side.
    """
    above = off_surface(x, ng, travelled)
    upwards = dot(n, wi) > F(0)
    outside, cosine = (ng, dot(n, wi)) if upwards else (scale(ng, F(-1)), -dot(n, wi))
    amount = share(cosine, dot(outside, wi))
    if upwards and amount == F(0):
        return above, wi, distance
    lifted = off_surface(x, outside, travelled)
    if amount > F(0):
        lifted = add(lifted, scale(bulge(surface, triangle, u, v, outside), amount))
    if distance > F(1e30):
        return lifted, wi, distance
    to_end = subtract(add(above, scale(wi, distance)), lifted)
    return lifted, normalize(to_end), dot(to_end, to_end) ** F(0.5)


@part
def share(cosine, geometric):
    """By how much of the bulge a ray is lifted, from its cosines with the shading and the geometric normal: 0 to 1, without jumps."""
    near = F(2) - (geometric + cosine) / GRAZING if cosine < GRAZING else F(1) - geometric / GRAZING
    return min(max(near, F(0)), F(1))


@part
def bulge(surface, triangle, u, v, outside):
    """From a point of a triangle to the curved surface that its normals mean, where that lies outside of it."""
    corners = surface.triangles[triangle]
    a, b, c = vector(surface.vertices, corners[0]), vector(surface.vertices, corners[1]), vector(surface.vertices, corners[2])
    normals = surface.normal[triangle]
    l, m, n = vector(normals, 0), vector(normals, 1), vector(normals, 2)  # noqa: E741  # of a, b and c
    w = F(1) - u - v
    between = add(add(scale(l, w), scale(m, u)), scale(n, v))
    if dot(between, outside) < F(0):
        l, m, n, between = scale(l, F(-1)), scale(m, F(-1)), scale(n, F(-1)), scale(between, F(-1))  # noqa: E741
    # Each edge is the chord of a parabola whose slope changes from end to end as the normals do.
    parabolas = w * u * _turn(a, b, l, m) + u * v * _turn(b, c, m, n) + v * w * _turn(c, a, n, l)
    x = add(add(scale(a, w), scale(b, u)), scale(c, v))
    planes = min(_below(x, a, b, c, l), _below(x, b, c, a, m), _below(x, c, a, b, n))
    return scale(between, max(planes, F(0.5) * parabolas))


@part
def _turn(a, b, n, m):
    """How much the normals n at a and m at b turn away from each other, times the length of the edge."""
    return dot(subtract(m, n), subtract(b, a))


@part
def _below(x, a, b, c, n):
    """How far x is below the plane across the normal n that the triangle is just beneath, where it goes through a or above it."""
    over = max(dot(subtract(b, a), n), dot(subtract(c, a), n), F(0))
    return max(dot(subtract(a, x), n) + over, F(0))
