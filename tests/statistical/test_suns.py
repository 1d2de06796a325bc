"""Suns in the world's shader: they are found where rays see them, drawn in proportion to their light, and the density is correct."""

import math
from dataclasses import replace

import numpy as np
import pytest

from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.kernels.sampling import vector
from blender_rl_guiding.lights.suns import around, without_suns
from blender_rl_guiding.lights.world import radiance, world_map, world_pdf
from blender_rl_guiding.scene.data import TABLE_SIZE, SceneData
from blender_rl_guiding.scene.description import Closure, Instruction, Node, Shader, Value
from blender_rl_guiding.shading.program import compile_shaders
from tests import scenes
from tests.significance import assert_distributed, assert_means, assert_uniform
from tests.world_draws import draw

N = 400_000
ELEVATION = 0.6
SKY = 0.05
SIZES = 0.3, 0.1  # angular diameters of two suns in radians, and their intensities
INTENSITIES = 60.0, 200.0
TURNS = (0.0, 0.0, 0.0), (0.3, -0.4, 2.5)
LIMB_MEAN = 0.8  # mean of a disc that is 0.6 darker at its edge


@kernel
def densities(table, wi, pdf):
    for i in range(len(wi)):
        pdf[i] = world_pdf(table, vector(wi, i))


def scene_under(world: Shader) -> SceneData:
    b = scenes.Builder()
    b.quad((0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), scenes.material("grey", (0.5,) * 3))
    table = np.ones((1, TABLE_SIZE, 4), np.float32)
    return replace(b.scene(scenes.look((9, 9, 9), (0, 0, 0), 40, 4, 4)), world=world, tables=table)


def under(*mapped: Instruction, size: float = SIZES[0], color: Value = SKY, intensity: float = INTENSITIES[0]) -> list[Instruction]:
    """A sun's shader. Its coordinates are the value of the last instruction of `mapped`; without instructions, the direction."""
    code = [Instruction("position"), *mapped]
    return [*code, Instruction("sun_disc", (Node(len(code) - 1), color, ELEVATION, size, intensity), options=(0, 0))]


def shader(code: list[Instruction]) -> Shader:
    return Shader("sky", tuple(code), (Closure("emission", 1.0, {"color": Node(len(code) - 1)}),))


def mapping(rotation=(0.0, 0.0, 0.0), scale=1.0, of: int = 0) -> Instruction:
    return Instruction("mapping", (Node(of), 0.0, rotation, scale), "VECTOR")


def two_suns() -> Shader:
    first = under(mapping(TURNS[0]))
    turned = mapping(TURNS[1])
    disc = Instruction("sun_disc", (Node(3), Node(2), ELEVATION, SIZES[1], INTENSITIES[1]), options=(0, 0))
    return shader([*first, turned, disc])


def brightest(world: Shader, axis: np.ndarray, size: float) -> np.ndarray:
    """Luminance just inside and just outside of the disc, all around."""
    shading = compile_shaders(scene_under(world))
    return np.stack([radiance(shading, rim(axis, size / 2 * share)) @ (0.2126, 0.7152, 0.0722) for share in (0.99, 1.01)])


def rim(axis: np.ndarray, angle: float) -> np.ndarray:
    turned = around(axis, math.pi, 16)
    aside = turned - (turned @ axis)[:, None] * axis
    return math.cos(angle) * axis + math.sin(angle) * aside / np.linalg.norm(aside, axis=1, keepdims=True)


@pytest.mark.parametrize(
    "code",
    [under(), under(mapping((0.3, -0.4, 2.5))), under(mapping(scale=(1.0, -1.0, 1.0))), under(size=0.0005)],
    ids=["as it is", "turned", "mirrored", "tiny"],
)
def test_a_sun_is_where_rays_see_it(code: list[Instruction]):
    world, size = shader(code), code[-1].inputs[3]
    assert isinstance(size, float)
    dark, (sun,) = without_suns(world, compile_shaders(scene_under(world)))
    inside, outside = brightest(world, sun.axis, size)
    assert inside.min() > 0.4 * INTENSITIES[0]
    np.testing.assert_allclose(outside, SKY, rtol=1e-5)
    assert size / 2 < sun.half < 1.01 * size / 2
    np.testing.assert_allclose(radiance(dark, around(sun.axis, sun.half, 9)), SKY, rtol=1e-5)
    assert sun.light == pytest.approx((LIMB_MEAN * INTENSITIES[0] + SKY) * 4 * math.pi * math.sin(size / 4) ** 2, rel=0.02)


def test_the_smallest_sun_is_drawn_from_evenly():
    """In single precision the cosine of this sun's radius is 1."""
    world = shader(under(size=0.0005))
    dark, (sun,) = without_suns(world, compile_shaders(scene_under(world)))
    table, _ = world_map(dark, [sun])
    u = np.random.default_rng(2).random((N, 3), np.float32)
    u[:, 1] = table.sunless + (1 - table.sunless) * u[:, 1] * np.float32(0.9999)
    wi, pdf = np.empty((N, 3), np.float32), np.empty(N, np.float32)
    draw(table, u, wi, pdf)
    aside = np.cross(wi.astype(float), table.suns[0].astype(float))
    squares = (aside**2).sum(axis=1) / math.sin(sun.half) ** 2
    assert (squares > 1).mean() < 2e-3  # rounding moves these just outside of the disc
    assert_uniform(squares.clip(0, 1)[:, None], 8)


@pytest.mark.parametrize("step", [mapping(scale=2.0), mapping(scale=(1.0, 1.0, 0.5)), Instruction("vector_math", (Node(0),) * 4, "SINE")])
def test_a_sun_that_is_no_cone_stays_in_the_map(step: Instruction):
    world = shader(under(step))
    shading = compile_shaders(scene_under(world))
    dark, suns = without_suns(world, shading)
    assert suns == []
    directions = around(np.array((0.0, 0.0, 1.0)), math.pi, 1000)
    np.testing.assert_array_equal(radiance(dark, directions), radiance(shading, directions))


def test_directions_are_drawn_by_the_light_of_map_and_suns():
    world = two_suns()
    dark, suns = without_suns(world, compile_shaders(scene_under(world)))
    table, total = world_map(dark, suns)
    wi, pdf = np.empty((N, 3), np.float32), np.empty(N, np.float32)
    draw(table, np.random.default_rng(1).random((N, 3), np.float32), wi, pdf)
    np.testing.assert_allclose(np.linalg.norm(wi, axis=1), 1, atol=1e-5)

    light = np.array([4 * np.pi * SKY, *(sun.light for sun in suns)])
    assert total == pytest.approx(light.sum(), rel=1e-3)
    cosines = np.stack([wi @ sun.axis for sun in suns])
    within = cosines > np.cos([[sun.half] for sun in suns])
    solid_angles = np.array([4 * np.pi * np.sin(sun.half / 2) ** 2 for sun in suns])
    shares = light / light.sum()
    even = shares[0] / (4 * np.pi)  # density of the map, which is uniform like the sky
    expected = shares[1:] + even * solid_angles
    assert_distributed(np.bincount(within[0] + 2 * within[1], minlength=3), N * np.array([1 - expected.sum(), *expected]))
    for sun, inside, cosine in zip(suns, within, cosines, strict=True):  # samples are uniform in the solid angle of the sun
        x, y = np.linalg.svd(sun.axis[None])[2][1:]
        turn = np.arctan2(wi[inside] @ y, wi[inside] @ x) / (2 * np.pi) + 0.5
        assert_uniform(np.stack([(1 - cosine[inside]) / (1 - np.cos(sun.half)), turn], axis=1).clip(0, 1 - 1e-7), 8)

    # The density is that of the samples, and the integral of the light over all directions has its analytic value.
    probes = around(np.array((0.0, 0.0, 1.0)), math.pi, 1 << 20)
    density = np.empty(len(probes), np.float32)
    densities(table, probes.astype(np.float32), density)
    assert density.mean() * 4 * np.pi == pytest.approx(1, rel=2e-3)
    estimate = radiance(compile_shaders(scene_under(world)), wi)[:, 0] / pdf
    on_paper = 4 * np.pi * SKY + sum(LIMB_MEAN * i * 4 * np.pi * np.sin(s / 4) ** 2 for i, s in zip(INTENSITIES, SIZES, strict=True))
    assert estimate.max() < 4 * on_paper  # no bright direction has a low density
    assert_means(estimate.mean(), estimate.var() / N + (2e-4 * on_paper) ** 2, on_paper)
