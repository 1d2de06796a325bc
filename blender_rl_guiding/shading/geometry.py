"""Values of shaders at the point: position, attributes, kind of ray, Fresnel terms, and bent normals."""

import math

from ..kernels import part, unlikely
from ..kernels.sampling import F, add, dot, scale, subtract, tangents
from ..scene.ops import Light, Weight
from ..scene.ray_kinds import CAMERA, DIFFUSE, GLOSSY, SHADOW, TRANSLUCENT, TRANSMISSION
from ..tracing.placing import step_to_mesh
from .arithmetic import lerp, saturate
from .operands import NONE, Point
from .vectors import combine, cross, unit

# --- position --------------------------------------------------------------------------------------------------------


@part
def position(shading, point):
    """The position of the point in world space; `point.x` unchanged if there is no object (lamps, the world)."""
    o = shading.origin
    return add(point.x, (o[0], o[1], o[2])) if point.object >= 0 else point.x


# --- attributes ------------------------------------------------------------------------------------------------------


@part
def attribute(shading, point, k):
    """Attribute k at the point; 0 if the object lacks it or there is no object."""
    if point.object < 0 or shading.attribute_rows[k, point.object] == NONE:
        return F(0), F(0), F(0)
    corners = shading.attributes[shading.attribute_rows[k, point.object] + point.triangle]
    u, v = point.u, point.v
    w = F(1) - u - v
    return (
        w * corners[0, 0] + u * corners[1, 0] + v * corners[2, 0],
        w * corners[0, 1] + u * corners[1, 1] + v * corners[2, 1],
        w * corners[0, 2] + u * corners[1, 2] + v * corners[2, 2],
    )


@part
def object_attribute(shading, point, k):
    """Object attribute k of the point's object; 0 if there is no object."""
    if point.object < 0:
        return F(0), F(0), F(0)
    row = shading.object_attributes[k, point.object]
    return row[0], row[1], row[2]


@part
def axes(shading, point, x, y, z, v):
    """v[0] X + v[1] Y + v[2] Z, with X, Y, Z the object attributes number x, y, z."""
    return combine(object_attribute(shading, point, x), object_attribute(shading, point, y), object_attribute(shading, point, z), v)


@part
def tangent(shading, point, k, x, y, z):
    """Attribute k as a direction in the `axes` x, y, z, turned to be perpendicular to the shading normal."""
    direction = axes(shading, point, x, y, z, attribute(shading, point, k))
    return cross(point.n, unit(cross(direction, point.n)))


# --- the ray ---------------------------------------------------------------------------------------------------------


@part
def light_path(mode, point):
    """The outputs of the Light Path node."""
    if mode == Light.RAY_LENGTH:
        return point.distance
    if mode == Light.RAY_DEPTH:
        return F(point.depth)
    if mode == Light.IS_CAMERA_RAY:
        return F(point.ray == CAMERA)
    if mode == Light.IS_SHADOW_RAY:
        return F(point.ray == SHADOW)
    if mode == Light.IS_DIFFUSE_RAY:
        return F(point.ray == DIFFUSE or point.ray == TRANSLUCENT)
    if mode == Light.IS_GLOSSY_RAY:
        return F(point.ray == GLOSSY or point.ray == TRANSMISSION)
    return F(point.ray == TRANSMISSION or point.ray == TRANSLUCENT)


@part
def dielectric(cosine, eta):
    """Reflectance of unpolarised light at an interface of relative index eta (Fresnel's equations)."""
    c = abs(cosine)
    g = eta * eta - F(1) + c * c
    if g <= F(0):
        return F(1)
    g = math.sqrt(g)
    a, b = (g - c) / (g + c), (c * (g + c) - F(1)) / (c * (g - c) + F(1))
    return F(0.5) * a * a * (F(1) + b * b)


@part
def fresnel(point, ior, n):
    """The Fresnel node."""
    ior = max(ior, F(1e-5))
    return dielectric(dot(point.wo, n), F(1) / ior if point.backfacing else ior)


@part
def layer_weight(mode, point, amount, n):
    """The Layer Weight node."""
    if mode == Weight.FRESNEL:
        eta = max(F(1) - amount, F(1e-5))
        return dielectric(dot(point.wo, n), eta if point.backfacing else F(1) / eta)
    cosine = abs(dot(point.wo, n))
    amount = min(max(amount, F(0)), F(1 - 1e-5))
    exponent = F(2) * amount if amount < F(0.5) else F(0.5) / (F(1) - amount)
    return F(1) - cosine**exponent


# --- normals ---------------------------------------------------------------------------------------------------------


@part
def usable(n, point):
    """n / |n|, with the opposite sign if the ray arrives from behind; the shading normal if n is zero or not finite."""
    n = unit(n)
    if not dot(n, n) > F(0.5):
        return point.n
    return scale(n, F(-1)) if point.backfacing else n


@part
def tangent_space(shading, point, v, strength, tangent_, sign, normal):
    """Normal map vector v in the object's space: s v.x T + s v.y B + z N, z = lerp(1, v.z, saturate(s)).

    s is the strength. T and N are attributes; B = sign (N x T). As in Cycles, T is not normalized again after interpolation.
    """
    t, n = attribute(shading, point, tangent_), unit(attribute(shading, point, normal))
    bitangent = scale(cross(n, t), attribute(shading, point, sign)[0])
    return combine(t, bitangent, n, (v[0] * strength, v[1] * strength, lerp(F(1), v[2], saturate(strength))))


@part
def bend(point, direction, strength):
    """normalize(n + s (d - n)): the shading normal n, bent towards direction d. The strength s may exceed 1."""
    n = usable(direction, point)
    return unit(add(point.n, scale(subtract(n, point.n), max(strength, F(0)))))


@part
def bump(point, heights, strength, distance, n):
    """n, tilted by the slope of `heights`. heights: at the point, and at its two neighbours (see `shifted`)."""
    t, b = tangents(point.ng)
    step = bump_step(point)
    slope_t, slope_b = (heights[1] - heights[0]) / step, (heights[2] - heights[0]) / step
    rise = add(scale(cross(b, n), slope_t), scale(cross(n, t), slope_b))
    facing = dot(n, point.ng)
    bent = unit(subtract(scale(n, abs(facing)), scale(rise, distance if facing >= F(0) else -distance)))
    if not dot(bent, bent) > F(0):
        return n
    strength = max(strength, F(0))
    return unit(add(scale(bent, strength), scale(n, F(1) - strength)))


# --- the points beside the point -------------------------------------------------------------------------------------


@part
def bump_step(point):
    """The distance in metres between two points whose heights give a slope: max(2^-12 t, 2^-16 max |x_i|, 1e-7).

    t is the ray's length: 2^-12 t is a quarter of a milliradian; an ordinary pixel has one milliradian. The other terms keep the distance
    above the rounding of positions and texture coordinates.
    """
    far = max(abs(point.x[0]), abs(point.x[1]), abs(point.x[2]))
    return max(point.distance * F(2**-12), far * F(2**-16), F(1e-7))


@part
def moved(shading, point, positions, d):
    """The point moved by d in the plane of its triangle, also beyond the edges. positions: number of the attribute with the corners."""
    x = add(point.x, d)
    instance = point.object - (shading.attribute_rows.shape[1] - shading.to_world.shape[0])
    if unlikely(instance >= 0):
        d = step_to_mesh(shading.to_world, instance, d)
    corners = shading.attributes[shading.attribute_rows[positions, point.object] + point.triangle]
    a = corners[1, 0] - corners[0, 0], corners[1, 1] - corners[0, 1], corners[1, 2] - corners[0, 2]
    b = corners[2, 0] - corners[0, 0], corners[2, 1] - corners[0, 1], corners[2, 2] - corners[0, 2]
    n = cross(a, b)
    area = dot(n, n)
    u, v = point.u + dot(cross(d, b), n) / area, point.v + dot(cross(a, d), n) / area
    return Point(
        x, point.n, point.ng, point.wo, point.triangle, point.object, u, v, point.backfacing, point.ray, point.distance, point.depth
    )


@part
def shifted(shading, point, positions, direction):
    """The point moved by `bump_step` along its triangle's first (`direction` 1) or second (2) tangent."""
    t, b = tangents(point.ng)
    return moved(shading, point, positions, scale(t if direction == 1 else b, bump_step(point)))
