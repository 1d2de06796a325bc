"""The world: its radiance by its shader, and a map of where it is bright, from which directions are drawn."""

import math
from typing import NamedTuple

import numpy as np

from ..bsdf.surface import emission
from ..kernels import kernel, part
from ..references import ref
from ..sampling import PI, TWO_PI, F, circle, luminance, scale
from ..shading.evaluate import run
from ..shading.operands import REGISTERS, Shading, make_point
from .alias import Alias, alias_table, draw

ROWS, COLUMNS = 512, 1024


class WorldMap(NamedTuple):
    """Equal steps of polar angle and azimuth, a cell as likely as the light from it."""

    cells: Alias
    pdf: np.ndarray  # (rows, columns) float32, per solid angle, of a direction in that cell


def world_map(shading: Shading) -> tuple[WorldMap, float]:
    """The map of a world that is not the same everywhere, and the integral of its luminance over all directions."""
    radiance = np.empty((ROWS, COLUMNS), np.float32)
    tabulate(shading, np.zeros((REGISTERS, 3), np.float32), radiance)
    edges = np.cos(np.linspace(0, np.pi, ROWS + 1))
    solid_angle = ((edges[:-1] - edges[1:]) * (2 * np.pi / COLUMNS))[:, None]
    power = radiance.astype(np.float64) * solid_angle
    total = power.sum()
    # A little everywhere: the shader was looked at in the middle of each cell only.
    power += 0.01 * (total or 1.0) * solid_angle / (4 * np.pi)
    share = power / power.sum()
    return WorldMap(alias_table(share.ravel()), (share / solid_angle).astype(np.float32)), float(total)


@kernel
def tabulate(shading, registers, radiance):
    """Luminance of the world in the middle of each cell."""
    shading = ref(shading)
    for row in range(ROWS):
        for column in range(COLUMNS):
            wi = _direction(F(row) + F(0.5), F(column) + F(0.5))
            radiance[row, column] = luminance(world_radiance(shading, registers, wi, np.int64(0), np.int64(0)))


@part
def world_radiance(shading, registers, wi, ray, depth):
    """What arrives from the direction wi, for a kind of ray; linear RGB."""
    world = shading.shaders.shape[0] - 1
    wo = scale(wi, F(-1))
    point = ref(make_point(wi, wo, wo, wo, -1, -1, F(0), F(0), 0, ray, F(0), depth))
    run(shading, world, point, registers)
    return emission(shading, world, point, registers)


@part
def _direction(row, column):
    theta, phi = row * (PI / F(ROWS)), column * (TWO_PI / F(COLUMNS))
    return math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)


@part
def sample_world(world, choice, u, v):
    """A direction by the map, by three uniform numbers."""
    cell, u = draw(world.cells, choice, u)
    row, column = cell // COLUMNS, cell % COLUMNS
    # Uniform in solid angle within the cell.
    top, bottom = math.cos(F(row) * (PI / F(ROWS))), math.cos(F(row + 1) * (PI / F(ROWS)))
    z = top + (bottom - top) * u
    r, (x, y) = math.sqrt(max(F(0), F(1) - z * z)), circle((F(column) + v) * F(1 / COLUMNS))
    return r * x, r * y, z


@part
def world_pdf(world, wi):
    """Density of `sample_world` per solid angle."""
    row = min(np.int32(math.acos(min(max(wi[2], F(-1)), F(1))) * F(ROWS / math.pi)), np.int32(ROWS - 1))
    turn = math.atan2(wi[1], wi[0]) / TWO_PI
    column = min(np.int32((turn + F(1) if turn < F(0) else turn) * F(COLUMNS)), np.int32(COLUMNS - 1))
    return world.pdf[row, column]
