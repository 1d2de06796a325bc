"""Lights: samples follow the density, hits agree with samples, and irradiance equals its analytic value."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import dblquad

from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.kernels.pointers import ref
from blender_rl_guiding.kernels.sampling import F, add, scale, store, vector
from blender_rl_guiding.lights import alias, inverse, lamps, world
from blender_rl_guiding.lights.emitters import lights, sample_light
from blender_rl_guiding.scene.description import IDENTITY, Lamp
from blender_rl_guiding.shading.operands import REGISTERS
from blender_rl_guiding.shading.program import compile_shaders
from blender_rl_guiding.tracing.geometry import Geometry
from tests import scenes
from tests.significance import assert_distributed, assert_means, assert_uniform
from tests.studio import bright_side

N = 400_000
WHITE = (1.0, 1.0, 1.0)


def numbers(count: int = N, dimensions: int = 2, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).random((count, dimensions), np.float32)


# --- alias tables ----------------------------------------------------------------------------------------------------


@kernel
def draw_alias(table, u, chosen, rest):
    for i in range(len(u)):
        chosen[i], rest[i] = alias.draw(table, u[i, 0], u[i, 1])


@pytest.mark.parametrize("weights", [[1.0], [1, 0, 3, 1e-3], np.random.default_rng(3).exponential(size=1000) ** 3, [0, 0, 1, 0]])
def test_alias_tables_draw_by_weight_and_leave_a_number_uniform(weights):
    weights = np.array(weights, float)
    chosen, rest = np.empty(N, np.int64), np.empty(N, np.float32)
    draw_alias(alias.alias_table(weights), numbers(), chosen, rest)
    assert_distributed(np.bincount(chosen, minlength=len(weights)), N * weights / weights.sum())
    assert_uniform(rest[:, None], 16)


def test_alias_tables_of_a_million_keep_rare_entries_rare():
    """With a single number of 24 bits, each share of a column would be rounded to a multiple of 1/16."""
    weights = np.where(np.arange(1 << 20) % 2, 1.0, 0.01)
    chosen, rest = np.empty(N, np.int64), np.empty(N, np.float32)
    draw_alias(alias.alias_table(weights), numbers(), chosen, rest)
    assert_distributed(np.bincount(chosen % 2), N * np.array([0.01, 1.0]) / 1.01)


# --- inverse tables --------------------------------------------------------------------------------------------------


@kernel
def draw_inverse(table, u, chosen, rest):
    for i in range(len(u)):
        chosen[i], rest[i] = inverse.draw(table, u[i])


@pytest.mark.parametrize("weights", [[1.0], [1, 0, 3, 1e-3], np.random.default_rng(3).exponential(size=1000) ** 3, [0, 0, 1, 0]])
def test_inverse_tables_are_monotone_and_leave_a_number_uniform(weights):
    """The entry for each number equals the result of NumPy's search."""
    weights, u = np.array(weights, float), np.sort(np.random.default_rng(1).random(N))
    chosen, rest = np.empty(N, np.int64), np.empty(N)
    draw_inverse(inverse.inverse_table(weights), u, chosen, rest)
    np.testing.assert_array_equal(chosen, np.searchsorted(weights.cumsum() / weights.sum(), u, side="right"))
    assert_distributed(np.bincount(chosen, minlength=len(weights)), N * weights / weights.sum())
    assert_uniform(rest[:, None], 16)


# --- lamps -----------------------------------------------------------------------------------------------------------

LAMPS = {
    "ball": Lamp("", "point", IDENTITY, WHITE, radius=0.4, soft=False),
    "disc": Lamp("", "point", IDENTITY, WHITE, radius=0.4),
    "spot": Lamp("", "spot", IDENTITY, WHITE, radius=0.3, soft=False, cone=0.6, blend=0.5),
    "sun": Lamp("", "sun", IDENTITY, WHITE, radius=0.3),
    "rectangle": Lamp("", "area", IDENTITY, WHITE, width=1.5, height=0.5),
    "ellipse": Lamp("", "area", IDENTITY, WHITE, width=1.5, height=0.5, ellipse=True),
    "grid": Lamp("", "area", IDENTITY, WHITE, width=1.5, height=0.5, spread=1.2),
}
POINTS = [(0.1, -0.2, -1.0), (0.9, 0.6, -0.5), (0.1, 0.05, -0.2)]  # the last point is inside the ball


@kernel
def draw_lamp(table, x, u, wi, distance, light, pdf):
    for i in range(len(u)):
        w, distance[i], radiance, pdf[i] = lamps.sample(table, 0, x, u[i, 0], u[i, 1])
        store(wi, i, w)
        light[i] = radiance[1]


@kernel
def meet_lamp(table, x, wi, distance, light, pdf):
    for i in range(len(wi)):
        distance[i], radiance, pdf[i] = lamps.hit(table, 0, x, vector(wi, i))
        light[i] = radiance[1]


@kernel
def shine(table, cosine, light):
    for i in range(len(cosine)):
        light[i] = lamps._area_radiance(table, 0, cosine[i])[0]


def sampled(lamp: Lamp, x, count: int = N) -> tuple[np.ndarray, ...]:
    out = np.empty((count, 3), np.float32), *(np.empty(count, np.float32) for _ in range(3))
    draw_lamp(lamps.lamp_table((lamp,)), tuple(map(F, x)), numbers(count), *out)
    return out


def met(lamp: Lamp, x, wi: np.ndarray) -> tuple[np.ndarray, ...]:
    out = tuple(np.empty(len(wi), np.float32) for _ in range(3))
    meet_lamp(lamps.lamp_table((lamp,)), tuple(map(F, x)), wi, *out)
    return out


def sphere(count: int, seed: int = 9) -> np.ndarray:
    wi = np.random.default_rng(seed).normal(size=(count, 3))
    return (wi / np.linalg.norm(wi, axis=1, keepdims=True)).astype(np.float32)


@pytest.mark.parametrize("x", POINTS)
@pytest.mark.parametrize("name", LAMPS)
def test_a_ray_meets_what_was_sampled(name, x):
    wi, distance, light, pdf = sampled(LAMPS[name], x, 10_000)
    found, shining, density = met(LAMPS[name], x, wi)
    hit = np.isfinite(found)
    assert hit.mean() > 0.995  # rounding makes some rays miss at the rim
    if name != "sun":
        np.testing.assert_allclose(found[hit], distance[hit], rtol=2e-3)
    np.testing.assert_allclose(shining[hit], light[hit], rtol=1e-3, atol=1e-5)
    np.testing.assert_allclose(density[hit], pdf[hit], rtol=3e-3)


@pytest.mark.parametrize("x", POINTS)
@pytest.mark.parametrize("name", LAMPS)
def test_lamps_are_sampled_by_their_density(name, x):
    """The integral of the density is 1. Over each cell around the lamp's middle, it equals the share of samples."""
    wi, *_ = sampled(LAMPS[name], x)
    total, spread = integral(LAMPS[name], x, sphere(1_000_000), 4 * np.pi)
    assert_means(total, spread, 1.0)
    frame = around(wi.mean(axis=0, dtype=float))
    lowest = max((wi @ frame[2]).min() - 1e-3, -1)
    cone = (1 - lowest) * 2 * np.pi
    z, turn = np.random.default_rng(3).random((2, 1_000_000))
    z, turn = lowest + (1 - lowest) * z, 2 * np.pi * turn
    r = np.sqrt(1 - z * z)
    probes = (np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1) @ frame).astype(np.float32)
    edges = np.quantile(wi @ frame[2], np.linspace(0, 1, 7)[1:-1])
    share = np.bincount(cells(wi @ frame.T, edges), minlength=48) / N
    mass, spread = integral(LAMPS[name], x, probes, cone, cells(probes @ frame.T, edges), 48)
    assert_means(share - mass, share * (1 - share) / N + spread + 1e-9, 0.0)


def integral(lamp: Lamp, x, probes: np.ndarray, solid_angle: float, cell: np.ndarray | None = None, count: int = 1):
    """(integrals of the density over cells, variances of these estimates). probes: uniform directions in a solid angle."""
    distance, _, pdf = met(lamp, x, probes)
    values = np.where(np.isfinite(distance), pdf, 0).astype(float) * solid_angle
    cell = np.zeros(len(probes), int) if cell is None else cell
    mean, squares = (np.bincount(cell, v, minlength=count) / len(probes) for v in (values, values**2))
    return mean, (squares - mean**2) / len(probes) + (1e-6 * mean) ** 2  # last term: rounding of a constant density


def around(middle: np.ndarray) -> np.ndarray:
    """(3, 3): two unit vectors perpendicular to the unit vector `middle`, then `middle`."""
    middle = middle / np.linalg.norm(middle)
    return np.vstack([np.linalg.svd(middle[None, :])[2][1:], middle])


def cells(local: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """The cell of each direction: rings around +z with cosines between `edges`, each divided into eight."""
    turn = np.arctan2(local[:, 1], local[:, 0]) / (2 * np.pi) % 1
    return np.searchsorted(edges, local[:, 2]) * 8 + (turn * 8).astype(int).clip(max=7)


def irradiance(lamp: Lamp, x) -> tuple[float, float]:
    """(irradiance of a surface at x that faces up, variance of the estimate), by sampling."""
    wi, _, light, pdf = sampled(lamp, x)
    values = light * np.maximum(wi[:, 2], 0) / np.where(pdf > 0, pdf, 1).astype(float)
    return values.mean(), values.var() / N + (1e-4 * values.mean()) ** 2


def test_irradiance_of_each_lamp():
    """1 / d^2 for balls and points, sin^2 for suns, Lambert's integral for areas."""
    x = (0.0, 0.0, -2.0)
    assert_means(*irradiance(LAMPS["ball"], x), 1 / 4)
    assert_means(*irradiance(Lamp("", "point", IDENTITY, WHITE), x), 1 / 4)
    assert_means(*irradiance(LAMPS["sun"], x), 1.0)
    assert_means(*irradiance(Lamp("", "sun", IDENTITY, WHITE), x), 1.0)
    truth = dblquad(lambda b, a: 4 / (4 + a * a + b * b) ** 2, -0.75, 0.75, -0.25, 0.25)[0]
    assert_means(*irradiance(LAMPS["rectangle"], x), truth)
    half = (lambda a: -math.sqrt(0.0625 - a * a / 9)), (lambda a: math.sqrt(0.0625 - a * a / 9))
    ellipse = dblquad(lambda b, a: 4 / (4 + a * a + b * b) ** 2, -0.75, 0.75, *half)[0]
    assert_means(*irradiance(LAMPS["ellipse"], x), ellipse)


def test_a_spread_keeps_the_power():
    """The integral of softbox radiance times cosine equals that of Lambert's emitter."""
    cosine = np.sqrt((np.arange(200_000) + 0.5) / 200_000).astype(np.float32)
    light = np.empty_like(cosine)
    shine(lamps.lamp_table((LAMPS["grid"],)), cosine, light)
    assert light.mean(dtype=float) == pytest.approx(1, rel=1e-4)


# --- triangles and the choice among all lights ------------------------------------------------------------------------


@kernel
def draw_lights(table, shading, surface, registers, x, u, points, emitters, pdf):
    table, shading, surface = ref(table), ref(shading), ref(surface)  # references, as in the tracer: compiled only once
    for i in range(len(u)):
        choice = np.float64(u[i, 0])
        wi, distance, _, pdf[i], emitters[i] = sample_light(table, shading, surface, registers, x, 0, choice, u[i, 1], u[i, 2])
        store(points, i, add(x, scale(wi, distance)))


def unfold(barycentric: np.ndarray) -> np.ndarray:
    """Maps uniform points in a triangle to uniform points in the unit square: (squared distance from corner 0, position across)."""
    s = barycentric.sum(axis=1)
    return np.stack([s * s, barycentric[:, 0] / s], axis=1).clip(0, 1)


def test_triangles_are_uniform_by_area_and_weighted_by_luminance():
    b = scenes.Builder()
    b.quad((0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), scenes.material("bright", emission=(4.0, 2.0, 1.0)))
    b.quad((0, 0, 1), (1, 0, 1), (1, 1, 2), (0, 1, 2), scenes.material("dark"))
    b.quad((5, 0, 0), (5, 1, 0), (5, 1, 5), (5, 0, 5), scenes.material("blue", emission=(0.0, 0.0, 3.0)))
    scene = b.scene(scenes.look((9, 9, 9), (0, 0, 0), 40, 4, 4))
    shading, geometry = compile_shaders(scene), Geometry(scene)
    table = lights(scene, shading, geometry.surface)
    corners = scene.vertices[scene.triangles[table.triangle]].astype(float)
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    pdf_area = table.pdf_area[scene.material[table.triangle]]
    assert (area * pdf_area).sum() == pytest.approx(1, abs=1e-6)
    assert table.pdf_area[1] == 0
    assert table.pdf_area[0] / table.pdf_area[2] == pytest.approx((4 * 0.2126 + 2 * 0.7152 + 0.0722) / (3 * 0.0722), rel=1e-5)
    points, chosen, pdf = np.empty((N, 3), np.float32), np.empty(N, np.int64), np.empty(N, np.float32)
    x = (F(3), F(3), F(3))
    draw_lights(table, shading, geometry.surface, np.zeros((REGISTERS, 3), np.float32), x, numbers(dimensions=3), points, chosen, pdf)
    assert_distributed(np.bincount(chosen, minlength=len(area) + 1)[:-1], N * area * pdf_area)
    for light, (a, b_, c) in enumerate(corners):
        edges = np.stack([b_ - a, c - a], axis=1)
        barycentric, residual, *_ = np.linalg.lstsq(edges, (points[chosen == light] - a).T)
        assert residual.max() < 1e-4
        assert_uniform(unfold(barycentric.T), 8)


# --- the world -------------------------------------------------------------------------------------------------------


@kernel
def draw_world(table, u, wi, pdf):
    for i in range(len(u)):
        w = world.sample_world(table, u[i, 0], u[i, 1], u[i, 2])
        store(wi, i, w)
        pdf[i] = world.world_pdf(table, w)


def test_the_world_is_drawn_by_its_brightness():
    b = scenes.Builder()
    b.quad((0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), scenes.material("grey", (0.5,) * 3))
    scene = replace(b.scene(scenes.look((9, 9, 9), (0, 0, 0), 40, 4, 4)), world=bright_side(1.0))
    table, total = world.world_map(compile_shaders(scene))
    assert total == pytest.approx(2 * np.pi / 4, rel=1e-4)
    wi, pdf = np.empty((N, 3), np.float32), np.empty(N, np.float32)
    draw_world(table, numbers(dimensions=3), wi, pdf)
    np.testing.assert_allclose(np.linalg.norm(wi, axis=1), 1, atol=1e-5)
    z, turn = wi[:, 2], np.arctan2(wi[:, 1], wi[:, 0]) % (2 * np.pi)
    counts, *_ = np.histogram2d(np.arccos(z), turn, bins=[np.linspace(0, np.pi, 33), np.linspace(0, 2 * np.pi, 65)])
    rows, columns = table.pdf.shape
    edges = np.cos(np.linspace(0, np.pi, rows + 1))
    mass = table.pdf.astype(float) * ((edges[:-1] - edges[1:]) * 2 * np.pi / columns)[:, None]
    assert mass.sum() == pytest.approx(1, rel=1e-5)
    assert_distributed(counts, N * mass.reshape(32, rows // 32, 64, columns // 64).sum(axis=(1, 3)))
    estimate = np.maximum(wi[:, 0], 0).astype(float) ** 3 / pdf
    assert_means(estimate.mean(), estimate.var() / N, np.pi / 2)
