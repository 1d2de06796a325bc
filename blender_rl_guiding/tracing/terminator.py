"""The start of shadow rays on smooth surfaces. It hides the triangles of the mesh at the terminator.

A coarse mesh with smooth normals represents a curved surface, which bulges over the triangles. The triangles would block grazing light
in steps, so a grazing ray starts on the curved surface. The rules are those of Cycles, with Cycles' default threshold.
"""

import math

from ..kernels import part
from ..kernels.sampling import F, add, dot, normalize, scale, subtract
from .geometry import corners_of, off_surface

GRAZING = F(0.1)  # cosine below which rays start on the curved surface


@part
def shadow_ray(surface, triangle, object_, u, v, x, error, n, ng, wi, distance):
    """The shadow ray from x to the light's point: (origin, unit direction, distance).

    x, error: from `hit_point`, at barycentrics u, v of an object's triangle. n, ng: shading and geometric normal, from `facing`.
    The light's point is x + error ng + distance wi.
    """
    above = off_surface(x, ng, error)
    upwards = dot(n, wi) > F(0)
    outside, cosine = (ng, dot(n, wi)) if upwards else (scale(ng, F(-1)), -dot(n, wi))
    amount = share(cosine, dot(outside, wi)) if surface.smooth[triangle] else F(0)
    if upwards and amount == F(0):
        return above, wi, distance
    lifted = off_surface(x, outside, error)
    if amount > F(0):
        lifted = add(lifted, scale(bulge(surface, triangle, object_, u, v, outside), amount))
    if distance > F(1e30):
        return lifted, wi, distance
    to_end = subtract(add(above, scale(wi, distance)), lifted)
    return lifted, normalize(to_end), math.sqrt(dot(to_end, to_end))


@part
def share(cosine, geometric):
    """The share of the bulge, 0 to 1, that lifts a ray. cosine, geometric: the ray's cosines with shading and geometric normal.

    The share is continuous in both cosines.
    """
    near = F(2) - (geometric + cosine) / GRAZING if cosine < GRAZING else F(1) - geometric / GRAZING
    return min(max(near, F(0)), F(1))


@part
def bulge(surface, triangle, object_, u, v, outside):
    """The vector from a point of a triangle to the curved surface of its normals; 0 where that surface is inside.

    outside: unit geometric normal, on the side of the ray.
    """
    a, b, c, n_a, n_b, n_c = corners_of(surface, triangle, object_)
    w = F(1) - u - v
    between = add(add(scale(n_a, w), scale(n_b, u)), scale(n_c, v))
    if dot(between, outside) < F(0):
        n_a, n_b, n_c, between = scale(n_a, F(-1)), scale(n_b, F(-1)), scale(n_c, F(-1)), scale(between, F(-1))
    # Each edge is the chord of a parabola. The parabola's slope changes from one end to the other as the normals do.
    parabolas = w * u * _turn(a, b, n_a, n_b) + u * v * _turn(b, c, n_b, n_c) + v * w * _turn(c, a, n_c, n_a)
    x = add(add(scale(a, w), scale(b, u)), scale(c, v))
    planes = min(_below(x, a, b, c, n_a), _below(x, b, c, a, n_b), _below(x, c, a, b, n_c))
    return scale(between, max(planes, F(0.5) * parabolas))


@part
def _turn(a, b, n_a, n_b):
    """(n_b - n_a) . (b - a): how far the normals diverge from a to b, times the length of the edge."""
    return dot(subtract(n_b, n_a), subtract(b, a))


@part
def _below(x, a, b, c, n):
    """The distance of x below a plane with normal n. The plane goes through the corner that is highest along n."""
    over = max(dot(subtract(b, a), n), dot(subtract(c, a), n), F(0))
    return max(dot(subtract(a, x), n) + over, F(0))
