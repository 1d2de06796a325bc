"""The world: its radiance, and a density over directions, made of a map of its brightness and of suns."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..bsdf.surface import emission
from ..kernels import kernel, part
from ..kernels.pointers import ref
from ..kernels.sampling import LUMINANCE, PI, TWO_PI, F, circle, cross, dot, place, scale, store, vector
from ..shading.evaluate import run
from ..shading.operands import REGISTERS, Shading, make_point
from .alias import Alias, alias_table, draw
from .lamps import in_cone

ROWS, COLUMNS = 512, 1024


class Sun(NamedTuple):
    """A bright cone of directions."""

    axis: np.ndarray  # (3,) unit vector to its middle
    half: float  # half angle of the cone, radians
    light: float  # integral of the luminance over its directions


class WorldMap(NamedTuple):
    """A density over directions: a grid of cells, with equal steps of polar angle and azimuth, and K suns.

    Cells and suns are drawn in proportion to their light. Within a cell or a sun, the density is uniform.
    """

    cells: Alias
    pdf: np.ndarray  # (rows, columns) float32, density per solid angle in each cell, times `sunless`
    sunless: np.float32  # probability of drawing a cell, not a sun
    suns: np.ndarray  # (K, 3) float32, their axes
    # (K, 4) float32, for a sun of half angle a: 1 - cos a; sin^2 a; density per solid angle times the sun's probability; sum of the
    # probabilities of suns 0 to this one
    cones: np.ndarray


def world_map(shading: Shading, suns: Sequence[Sun] = ()) -> tuple[WorldMap, float]:
    """The map of a world that varies, and the integral of its luminance over all directions, suns included.

    shading: shaders whose last one is the world without `suns`. The probability of a sun is its share of the integral, or more.
    """
    edges = np.cos(np.linspace(0, np.pi, ROWS + 1))
    solid_angle = ((edges[:-1] - edges[1:]) * (2 * np.pi / COLUMNS))[:, None]
    power = radiance(shading, _middles()).reshape(ROWS, COLUMNS, 3) @ LUMINANCE * solid_angle
    light = np.array([power.sum(), *(sun.light for sun in suns)])
    # Add 1 %, uniform over the sphere, because the shader was evaluated only in the middle of each cell.
    power += 0.01 * (power.sum() or 1.0) * solid_angle / (4 * np.pi)
    share = power / power.sum()
    chance = np.maximum(light, 0.01 * light.sum() or 1.0)  # at least 1 %, because the estimate of the light may be too small
    chance /= chance.sum()
    cones = np.array([_cone(sun.half) for sun in suns]).reshape(-1, 2)
    columns = *cones.T, chance[1:] / (2 * np.pi * cones[:, 0]), np.cumsum(chance[1:])
    return WorldMap(
        alias_table(share.ravel()),
        (share / solid_angle * chance[0]).astype(np.float32),
        F(chance[0]),
        np.array([sun.axis for sun in suns], np.float32).reshape(-1, 3),
        np.stack(columns, axis=1).astype(np.float32),
    ), float(light.sum())


def no_world() -> WorldMap:
    """The map of a world that light sampling never picks."""
    none = np.zeros((0, 4), np.float32)
    return WorldMap(alias_table(np.ones(1)), np.zeros((1, 1), np.float32), F(1), none[:, :3].copy(), none)


def _cone(half: float) -> tuple[float, float]:
    return 2 * math.sin(half / 2) ** 2, math.sin(half) ** 2


def _middles() -> np.ndarray:
    """(ROWS COLUMNS, 3), the directions through the middles of the cells."""
    theta, phi = (np.arange(ROWS)[:, None] + 0.5) * (np.pi / ROWS), (np.arange(COLUMNS) + 0.5) * (2 * np.pi / COLUMNS)
    x, y, z = np.broadcast_arrays(np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta))
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def radiance(shading: Shading, directions: np.ndarray) -> np.ndarray:
    """Radiance from unit `directions`, (N, 3), as light sampling sees it: linear RGB, (N, 3) float64."""
    colors = np.ascontiguousarray(directions, np.float32).copy()
    _look(shading, np.zeros((REGISTERS, 3), np.float32), colors)
    return colors.astype(np.float64)


@kernel
def _look(shading, registers, rows):
    """Replace each direction in `rows`, (N, 3), by the radiance from it."""
    shading = ref(shading)
    for i in range(rows.shape[0]):
        store(rows, i, world_radiance(shading, registers, vector(rows, i), np.int64(0), np.int64(0)))


@part
def world_radiance(shading, registers, wi, ray, depth):
    """Radiance that arrives from direction wi, linear RGB, for a kind of ray after `depth` scattering events."""
    world = shading.shaders.shape[0] - 1
    wo = scale(wi, F(-1))
    point = ref(make_point(wi, wo, wo, wo, -1, -1, F(0), F(0), 0, ray, F(0), depth))
    run(shading, world, point, registers)
    return emission(shading, world, point, registers)


@part
def sample_world(world, choice, u, v):
    """A direction from the map or a sun; choice, u and v are uniform in [0, 1)."""
    suns = world.suns.shape[0]
    if suns > 0 and u >= world.sunless:
        u -= world.sunless
        return _sample_sun(world, u, v)
    u = min(u / world.sunless, F(1 - 2**-24))
    cell, u = draw(world.cells, choice, u)
    row, column = cell // COLUMNS, cell % COLUMNS
    # Uniform in solid angle within the cell.
    top, bottom = math.cos(F(row) * (PI / F(ROWS))), math.cos(F(row + 1) * (PI / F(ROWS)))
    z = top + (bottom - top) * u
    r, (x, y) = math.sqrt(max(F(0), F(1) - z * z)), circle((F(column) + v) * F(1 / COLUMNS))
    return r * x, r * y, z


@part
def _sample_sun(world, u, v):
    """A direction within a sun; u is uniform in [0, 1 - sunless)."""
    k, before, last = 0, F(0), world.suns.shape[0] - 1
    while k < last and u >= world.cones[k, 3]:
        before = world.cones[k, 3]
        k += 1
    within = (u - before) / (world.cones[k, 3] - before)
    return in_cone(vector(world.suns, k), world.cones[k, 0], min(max(within, F(0)), F(1)), v)


@part
def world_pdf(world, wi):
    """Density of `sample_world` per solid angle."""
    row = place(math.acos(min(max(wi[2], F(-1)), F(1))) * F(ROWS / math.pi), ROWS)
    turn = math.atan2(wi[1], wi[0]) / TWO_PI
    pdf = world.pdf[row, place((turn + F(1) if turn < F(0) else turn) * F(COLUMNS), COLUMNS)]
    for k in range(world.suns.shape[0]):
        axis = vector(world.suns, k)
        aside = cross(axis, wi)
        if dot(axis, wi) > F(0) and dot(aside, aside) < world.cones[k, 1]:
            pdf += world.cones[k, 2]
    return pdf
