"""Lamps: points, spots, suns and areas. Light sampling can sample all of them; rays can hit a lamp with a size.

A sample is (wi, distance, radiance, pdf), with the pdf per solid angle. If no ray can hit the lamp, pdf = 0, and `radiance` is the
irradiance on a surface that faces the lamp.
"""

import math
from typing import get_args

import numpy as np

from ..kernels import part
from ..kernels.sampling import INV_PI, LUMINANCE, PI, TWO_PI, F, add, circle, cross, dot, scale, subtract, tangents, to_world
from ..scene.description import Lamp, LampKind
from ..scene.ray_kinds import EMITTERS, seen_by

_KINDS = get_args(LampKind)
POINT, SPOT, SUN, AREA = range(len(_KINDS))
# Columns of the table of lamps.
KIND, AXIS_X, AXIS_Y, AXIS_Z, POSITION, EMISSION, RADIUS, SOFT, CONE, SMOOTH = 0, 1, 4, 7, 10, 13, 16, 17, 18, 19
WIDTH, HEIGHT, ELLIPSE, SPREAD, SPREAD_SCALE, VISIBILITY, SHADOW, HITTABLE, SHADER, COLUMNS = 20, 21, 22, 23, 24, 25, 26, 27, 28, 29
NOWHERE = F(np.inf)
DARK = (F(0), F(0), F(0))


def lamp_table(lamps: tuple[Lamp, ...]) -> np.ndarray:
    """The lamps as rows for kernels, (K, COLUMNS) float32."""
    table = np.zeros((len(lamps), COLUMNS), np.float32)
    for row, lamp in zip(table, lamps, strict=True):
        axes = np.array(lamp.to_world)[:3]
        row[[KIND, RADIUS, SOFT, WIDTH, HEIGHT, ELLIPSE]] = (
            _KINDS.index(lamp.kind),
            lamp.radius,
            lamp.soft,
            lamp.width,
            lamp.height,
            lamp.ellipse,
        )
        row[AXIS_X:EMISSION] = axes.T.ravel()
        row[EMISSION:RADIUS] = lamp.emission
        row[CONE], row[SMOOTH] = _cone(lamp)
        row[SPREAD], row[SPREAD_SCALE] = _spread(lamp)
        size = lamp.width * lamp.height * lamp.spread if lamp.kind == "area" else lamp.radius
        row[[VISIBILITY, SHADOW, HITTABLE]] = seen_by(lamp.visibility, EMITTERS), lamp.shadow, lamp.mis and size > 0
        row[SHADER] = lamp.shader
    return table


def power(lamp: Lamp, emission: np.ndarray, scene_radius: float) -> float:
    """The approximate power that a lamp of `emission`, (3,), sends into the scene, as luminance. Only ratios of powers are used."""
    luminance = float(np.dot(emission, LUMINANCE))
    if lamp.kind == "area":
        return luminance * math.pi * lamp.width * lamp.height * (math.pi / 4 if lamp.ellipse else 1)
    if lamp.kind == "sun":
        return luminance * math.pi * scene_radius**2
    return luminance * (2 * math.pi * (1 - math.cos(lamp.cone)) if lamp.kind == "spot" else 4 * math.pi)


def _cone(lamp: Lamp) -> tuple[float, float]:
    """Cosine c at the edge of a spot's cone, and the factor s of its falloff smoothstep(s (cos - c))."""
    edge = math.cos(lamp.cone)
    return edge, 1 / max((1 - edge) * lamp.blend, 1e-6)


def _spread(lamp: Lamp) -> tuple[float, float]:
    """(tan(spread / 2), or NOWHERE for a spread of pi; the factor on the radiance that preserves the power)."""
    half = lamp.spread / 2
    if half > math.pi / 2 - 1e-3:
        return float(NOWHERE), 1.0
    over = math.tan(half) - half if half > 1e-3 else half**3 / 3
    return math.tan(half), 1 / max(over, 1e-30)


@part
def three(lamps, k, column):
    """The vector or colour in columns `column` to `column` + 2 of lamp k."""
    return lamps[k, column], lamps[k, column + 1], lamps[k, column + 2]


@part
def sample(lamps, k, x, u, v):
    """A sample (wi, distance, radiance, pdf) of lamp k from x, by u and v in [0, 1); see the top of this file."""
    kind = lamps[k, KIND]
    if kind == F(SUN):
        return _sample_sun(lamps, k, u, v)
    if kind == F(AREA):
        return _sample_area(lamps, k, x, u, v)
    return _sample_ball(lamps, k, x, u, v)


@part
def hit(lamps, k, origin, wi):
    """The hit of a ray on lamp k: (distance, or NOWHERE for a miss; radiance; pdf of wi in `sample`)."""
    kind = lamps[k, KIND]
    if kind == F(SUN):
        return _hit_sun(lamps, k, wi)
    if kind == F(AREA):
        return _hit_area(lamps, k, origin, wi)
    return _hit_disc(lamps, k, origin, wi) if lamps[k, SOFT] > F(0) else _hit_ball(lamps, k, origin, wi)


# --- points and spots ------------------------------------------------------------------------------------------------


@part
def _ball_radiance(lamps, k, wi):
    """Radiance of a point or spot, RGB; the radiant intensity if the radius is 0."""
    emission = three(lamps, k, EMISSION)
    r = lamps[k, RADIUS]
    if r > F(0):
        emission = scale(emission, INV_PI / (r * r))
    if lamps[k, KIND] == F(SPOT):
        inside = (dot(three(lamps, k, AXIS_Z), wi) - lamps[k, CONE]) * lamps[k, SMOOTH]
        t = min(max(inside, F(0)), F(1))
        emission = scale(emission, t * t * (F(3) - F(2) * t))
    return emission


@part
def _sample_ball(lamps, k, x, u, v):
    centre, r = three(lamps, k, POSITION), lamps[k, RADIUS]
    to_centre = subtract(centre, x)
    squared = max(dot(to_centre, to_centre), F(1e-12))
    distance = math.sqrt(squared)
    axis = scale(to_centre, F(1) / distance)
    if r == F(0):
        return axis, distance, scale(_ball_radiance(lamps, k, axis), F(1) / squared), F(0)
    if lamps[k, SOFT] > F(0):
        t, b = tangents(axis)
        rho, (cosine, sine) = r * math.sqrt(u), circle(v)
        y = add(to_centre, add(scale(t, rho * cosine), scale(b, rho * sine)))
        far = math.sqrt(dot(y, y))
        wi = scale(y, F(1) / far)
        return wi, far, _ball_radiance(lamps, k, wi), far * far * INV_PI / (r * r * dot(axis, wi))
    if distance <= r:  # x is inside the ball: every direction hits it
        z, (a, b) = F(1) - F(2) * u, circle(v)
        rho = math.sqrt(max(F(0), F(1) - z * z))
        wi = (rho * a, rho * b, z)
        return wi, _ball_distance(to_centre, r, wi), _ball_radiance(lamps, k, wi), F(0.25) * INV_PI
    opening = _opening(r, distance)
    wi = in_cone(axis, opening, u, v)
    return wi, _ball_distance(to_centre, r, wi), _ball_radiance(lamps, k, wi), F(1) / (TWO_PI * opening)


@part
def in_cone(axis, opening, u, v):
    """A direction uniform in the cone around `axis` of half angle a. opening: 1 - cos a; the solid angle is 2 pi opening."""
    t, b = tangents(axis)
    x, y = circle(v)
    versine = u * opening
    sine = math.sqrt(versine * (F(2) - versine))  # not from the cosine: near 1 it has few correct bits
    return to_world(t, b, axis, (sine * x, sine * y, F(1) - versine))


@part
def _opening(r, distance):
    """1 - cos a for the half angle a that a ball covers, sin a = r / distance. Accurate for small balls, too."""
    squared = min(r * r / (distance * distance), F(1))
    return squared / (F(1) + math.sqrt(F(1) - squared))


@part
def _ball_distance(to_centre, r, wi):
    """Distance at which a ray first crosses the ball's surface. If rounding makes the ray miss: distance of the closest approach."""
    along = dot(to_centre, wi)
    aside = subtract(to_centre, scale(wi, along))
    half = math.sqrt(max(F(0), r * r - dot(aside, aside)))
    return along - half if along > half else along + half


@part
def _hit_ball(lamps, k, origin, wi):
    r, to_centre = lamps[k, RADIUS], subtract(three(lamps, k, POSITION), origin)
    along = dot(to_centre, wi)
    aside = subtract(to_centre, scale(wi, along))
    squared = dot(to_centre, to_centre)
    inside = squared <= r * r
    if dot(aside, aside) > r * r or (along < F(0) and not inside):
        return NOWHERE, DARK, F(0)
    pdf = F(0.25) * INV_PI if inside else F(1) / (TWO_PI * _opening(r, math.sqrt(squared)))
    return _ball_distance(to_centre, r, wi), _ball_radiance(lamps, k, wi), pdf


@part
def _hit_disc(lamps, k, origin, wi):
    r, to_centre = lamps[k, RADIUS], subtract(three(lamps, k, POSITION), origin)
    squared = dot(to_centre, to_centre)
    along = dot(to_centre, wi)
    if along <= F(0) or squared == F(0):
        return NOWHERE, DARK, F(0)
    distance = squared / along  # to the plane of the disc: through the centre, perpendicular to `to_centre`
    aside = subtract(to_centre, scale(wi, distance))
    if dot(aside, aside) > r * r:
        return NOWHERE, DARK, F(0)
    cosine = along / math.sqrt(squared)
    return distance, _ball_radiance(lamps, k, wi), distance * distance * INV_PI / (r * r * cosine)


# --- suns ------------------------------------------------------------------------------------------------------------


@part
def _sample_sun(lamps, k, u, v):
    axis, angle = three(lamps, k, AXIS_Z), lamps[k, RADIUS]
    if angle == F(0):
        return axis, NOWHERE, three(lamps, k, EMISSION), F(0)
    opening = F(2) * math.sin(F(0.5) * angle) ** F(2)
    wi = in_cone(axis, opening, u, v)
    return wi, NOWHERE, _sun_radiance(lamps, k), F(1) / (TWO_PI * opening)


@part
def _sun_radiance(lamps, k):
    """L = E / (pi sin^2 radius), with E the irradiance on a surface that faces the middle of the sun."""
    sine = math.sin(lamps[k, RADIUS])
    return scale(three(lamps, k, EMISSION), INV_PI / (sine * sine))


@part
def _hit_sun(lamps, k, wi):
    axis = three(lamps, k, AXIS_Z)
    aside = cross(axis, wi)
    sine = math.sin(lamps[k, RADIUS])
    if dot(axis, wi) <= F(0) or dot(aside, aside) > sine * sine:
        return NOWHERE, DARK, F(0)
    opening = F(2) * math.sin(F(0.5) * lamps[k, RADIUS]) ** F(2)
    return F(3e38), _sun_radiance(lamps, k), F(1) / (TWO_PI * opening)


# --- areas -----------------------------------------------------------------------------------------------------------


@part
def _area(lamps, k):
    return lamps[k, WIDTH] * lamps[k, HEIGHT] * (F(0.25) * PI if lamps[k, ELLIPSE] > F(0) else F(1))


@part
def _area_radiance(lamps, k, cosine):
    """Radiance at an angle a from the axis. A spread below pi scales it by max(0, tan(spread / 2) - tan a), as a softbox's grid does."""
    emission = three(lamps, k, EMISSION)
    if lamps[k, SPREAD] == NOWHERE:
        return emission
    tangent = math.sqrt(max(F(0), F(1) - cosine * cosine)) / cosine
    return scale(emission, max(F(0), lamps[k, SPREAD] - tangent) * lamps[k, SPREAD_SCALE])


@part
def _sample_area(lamps, k, x, u, v):
    if lamps[k, SPREAD] == F(0):
        return _sample_beam(lamps, k, x)
    a, b = u - F(0.5), v - F(0.5)
    if lamps[k, ELLIPSE] > F(0):
        rho, (a, b) = F(0.5) * math.sqrt(u), circle(v)
        a, b = rho * a, rho * b
    centre = subtract(three(lamps, k, POSITION), x)
    y = add(centre, add(scale(three(lamps, k, AXIS_X), a * lamps[k, WIDTH]), scale(three(lamps, k, AXIS_Y), b * lamps[k, HEIGHT])))
    squared = max(dot(y, y), F(1e-12))
    distance = math.sqrt(squared)
    wi = scale(y, F(1) / distance)
    cosine = dot(three(lamps, k, AXIS_Z), wi)
    if cosine <= F(1e-6):
        return wi, distance, DARK, F(1)
    return wi, distance, _area_radiance(lamps, k, cosine), squared / (cosine * _area(lamps, k))


@part
def _sample_beam(lamps, k, x):
    """A sample of a lamp with spread 0: all its light is parallel to the axis, like that of a sun of radius 0."""
    axis = three(lamps, k, AXIS_Z)
    distance = _area_distance(lamps, k, x, axis)
    light = scale(three(lamps, k, EMISSION), PI) if distance < NOWHERE else DARK
    return axis, distance, light, F(0)


@part
def _area_distance(lamps, k, origin, wi):
    """Distance at which a ray meets the front of the lamp; NOWHERE if the ray misses."""
    cosine = dot(three(lamps, k, AXIS_Z), wi)
    to_centre = subtract(three(lamps, k, POSITION), origin)
    along = dot(to_centre, three(lamps, k, AXIS_Z))
    if cosine <= F(1e-6) or along <= F(0):
        return NOWHERE
    distance = along / cosine
    aside = subtract(scale(wi, distance), to_centre)
    a, b = dot(aside, three(lamps, k, AXIS_X)) / lamps[k, WIDTH], dot(aside, three(lamps, k, AXIS_Y)) / lamps[k, HEIGHT]
    inside = a * a + b * b <= F(0.25) if lamps[k, ELLIPSE] > F(0) else max(abs(a), abs(b)) <= F(0.5)
    return distance if inside else NOWHERE


@part
def _hit_area(lamps, k, origin, wi):
    distance = _area_distance(lamps, k, origin, wi)
    if distance == NOWHERE:
        return NOWHERE, DARK, F(0)
    cosine = dot(three(lamps, k, AXIS_Z), wi)
    return distance, _area_radiance(lamps, k, cosine), distance * distance / (cosine * _area(lamps, k))
