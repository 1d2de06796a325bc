"""Scenes with an analytic image: furnaces, single bounces, and a rectangular lamp over a plane."""

import math
from itertools import pairwise

import numpy as np
import pytest

from blender_rl_guiding.render import Result, render
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.settings import BSDF, Machine, Render, Uniform
from tests import scenes, unions
from tests.significance import assert_means

MACHINE = Machine(batch=4096)
GUIDES = unions.guides()
OTHERS = [guide for guide in GUIDES if guide != BSDF()]
by_guide = pytest.mark.parametrize("guide", GUIDES, ids=unions.name)
by_nee = pytest.mark.parametrize("nee", [False, True], ids=["", "nee"])
ALBEDO, EMISSION = 0.6, 0.8


def assert_flat(result: Result, truth: float) -> None:
    """The mean of each channel is the truth. Pixels are independent; a pixel has at most the film's variance."""
    variance = result.film.variance_of_mean()
    pixels = result.image.shape[0] * result.image.shape[1]
    assert_means(result.image.mean(axis=(0, 1), dtype=float), variance.sum(axis=(0, 1)) / pixels**2, truth)


def series(bounces: int) -> float:
    """E (1 - a^(n+1)) / (1 - a): radiance in a furnace with at most n scattering events."""
    return EMISSION * sum(ALBEDO**k for k in range(bounces + 1))


# --- white surfaces in white surroundings ------------------------------------------------------------------------------


def test_white_cube_is_invisible_to_the_bit_of_rounding():
    image = render(scenes.white_cube(), Render(spp=64, guide=BSDF()), MACHINE).image
    np.testing.assert_allclose(image, 1, rtol=2e-6)


@pytest.mark.parametrize("guide", OTHERS, ids=unions.name)
def test_white_cube_is_invisible_in_the_mean(guide):
    result = render(scenes.white_cube(), Render(spp=200, guide=guide), MACHINE)
    assert_flat(result, 1)
    assert result.film.variance_of_mean().max() > 0


# --- inside a closed box: E (1 - a^(n+1)) / (1 - a) ----------------------------------------------------------------------


@pytest.mark.parametrize("bounces", [0, 1, 2, 7])
def test_box_by_bsdf_is_exact_in_every_sample(bounces):
    scene = scenes.furnace_box(ALBEDO, EMISSION)
    image = render(scene, Render(spp=64, nee=False, max_bounces=bounces), MACHINE).image
    np.testing.assert_allclose(image, series(bounces), rtol=5e-6)


@pytest.mark.parametrize(
    ("guide", "nee"),
    [*((guide, False) for guide in OTHERS), *((guide, True) for guide in GUIDES)],  # BSDF sampling alone has no noise
    ids=lambda value: value if isinstance(value, bool) else unions.name(value),
)
def test_box_in_the_mean(guide, nee):
    result = render(scenes.furnace_box(ALBEDO, EMISSION), Render(spp=150, nee=nee, guide=guide), MACHINE)
    assert_flat(result, series(6))


def test_scenes_own_depth_is_taken_unless_another_is_asked_for():
    scene = scenes.furnace_box(ALBEDO, EMISSION, max_bounces=3)
    assert render(scene, Render(spp=1, nee=False), MACHINE).image.mean() == pytest.approx(series(3), rel=1e-5)
    assert render(scene, Render(spp=1, nee=False, max_bounces=5), MACHINE).image.mean() == pytest.approx(series(5), rel=1e-5)


@by_guide
def test_no_bounce_shows_emitters_only(guide):
    scene = scenes.tiny()
    image = render(scene, Render(spp=8, max_bounces=0, nee=True, guide=guide), MACHINE).image
    emissions = np.array([[0, 0, 0], *(c.inputs["color"] for s in scene.shaders for c in s.closures if c.kind == "emission")])
    hull = emissions.min(axis=0), emissions.max(axis=0)
    assert (image >= hull[0] - 1e-6).all()
    assert (image <= hull[1] + 1e-6).all()
    assert len(np.unique(image.round(4), axis=0)) > 1
    np.testing.assert_array_equal(
        image, render(scene, Render(spp=8, nee=False, max_bounces=0), MACHINE).image
    )  # guides and NEE have no effect


def test_every_bounce_adds_its_own_share():
    """Random numbers do not depend on the depth limit, so renders with n and n + 1 bounces differ by the contribution of one bounce."""
    scene = scenes.furnace_box(ALBEDO, EMISSION, size=32)
    limits = [render(scene, Render(spp=64, nee=False, max_bounces=n, guide=Uniform()), MACHINE).image for n in range(4)]
    for n, (less, more) in enumerate(pairwise(limits), start=1):
        share = (more - less)[..., 0].astype(float)
        assert_means(share.mean(), share.var() / share.size, EMISSION * ALBEDO**n)


@by_guide
def test_learning_goes_on_where_every_path_misses(guide):
    scene = scenes.lit_quad(scenes.look((0, -2, 0), (0, -9, 0), 40, 8, 8))
    np.testing.assert_array_equal(render(scene, Render(spp=4, guide=guide), MACHINE).image, 0)


# --- inside a sphere: light and BSDF sampling agree ----------------------------------------------------------------------


def test_sphere_with_next_event_estimation_has_no_noise():
    """Both densities are cos / pi, so with the balance heuristic every estimate is exact, except for the tessellation."""
    result = render(scenes.furnace_sphere(ALBEDO, EMISSION), Render(spp=32, nee=True), MACHINE)
    assert result.image.mean() == pytest.approx(series(6), rel=2e-3)
    assert np.sqrt(result.film.variance_of_mean().mean() * 32) < 0.05 * series(6)


# --- a rectangle's light on a plane --------------------------------------------------------------------------------------


def plane_below_lamp(x: float, size: float) -> SceneData:
    """A camera looks at the point x of a floor, below a lamp of 1.2 x 0.8 at height 0.7. All lengths are in units of `size`."""
    b, s = scenes.Builder(), size
    b.quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), scenes.material("floor", (0.5, 0.5, 0.5)))
    low, high, y, z = x - 0.6 * s, x + 0.6 * s, 0.4 * s, 0.7 * s
    b.quad((low, -y, z), (low, y, z), (high, y, z), (high, -y, z), scenes.material("lamp", emission=(5.0, 5.0, 5.0)))
    return b.scene(scenes.look((x + 3 * s, 0, 0.5 * s), (x, 0, 0), 0.05, 24, 24), max_bounces=1)


def form_factor(a: float, b: float, c: float) -> float:
    """Form factor from a point to a parallel rectangle a x b at distance c, with a corner straight above (Howell, B-4)."""
    x, y = a / c, b / c
    p, q = math.sqrt(1 + x * x), math.sqrt(1 + y * y)
    return (x / p * math.atan(y / p) + y / q * math.atan(x / q)) / (2 * math.pi)


@by_nee
@by_guide
@pytest.mark.parametrize(("x", "size"), [(0.0, 1.0), (3.0, 0.1)], ids=["", "close"])
def test_lamp_lights_the_floor_by_its_form_factor(x, size, guide, nee):
    """radiance = albedo / pi * irradiance = albedo * emission * form factor, close to the lamp and far from the origin, too."""
    result = render(plane_below_lamp(x, size), Render(spp=120, nee=nee, guide=guide), MACHINE)
    assert_flat(result, 0.5 * 5.0 * 4 * form_factor(0.6, 0.4, 0.7))


def test_both_sides_of_an_emitter_shine():
    """It is the same in Cycles, so exported scenes agree."""
    b = scenes.Builder()
    b.quad((-9, 2, -9), (-9, 2, 9), (9, 2, 9), (9, 2, -9), scenes.material("lamp", emission=(1.0, 2.0, 3.0)))
    for target in ((0, 1, 0), (0, -1, 0)):
        camera = scenes.look((0, 2 - 2 * target[1], 0), (0, 2, 0), 20, 4, 4)
        np.testing.assert_allclose(render(b.scene(camera), Render(spp=1), MACHINE).image, np.broadcast_to([1, 2, 3], (4, 4, 3)))
