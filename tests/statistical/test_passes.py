"""Passes equal renders with fewer bounces, or the geometry that the camera sees."""

from dataclasses import replace

import numpy as np
import pytest

from blender_rl_guiding.render import Result, render
from blender_rl_guiding.scene.description import Camera, Closure, Film, Shader
from blender_rl_guiding.settings import BSDF, Machine, Render, Uniform
from tests import scenes
from tests.studio import studio

MACHINE = Machine(batch=4096)
SPP = 16
FROM_ABOVE = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 2.0), (0.0, 0.0, 0.0, 1.0))  # at z = 2, looks down
OPEN = scenes.look((0, 0, 0), (0, 1, 0), 90, 8, 8)


@pytest.mark.parametrize("nee", [False, True], ids=["", "nee"])
@pytest.mark.parametrize(
    ("guide", "emphasis"), [(BSDF(), 0.0), (Uniform(), 0.0), (BSDF(), 0.5)], ids=lambda value: getattr(value, "kind", value)
)
def test_emission_and_direct_light_are_what_fewer_bounces_give(guide, emphasis, nee):
    """Random numbers do not depend on the depth limit, so a render with fewer bounces has the same paths, but shorter."""
    scene = studio(24)
    settings = Render(spp=SPP, max_bounces=5, nee=nee, emphasis=emphasis, guide=guide)
    image, emission, direct = (render(scene, replace(settings, max_bounces=n), MACHINE).image for n in (5, 0, 1))
    result = render(scene, replace(settings, passes=True), MACHINE)
    layers = result.film.layers()
    np.testing.assert_array_equal(result.image, image)  # passes change nothing
    np.testing.assert_allclose(layers["Emission"], emission, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(layers["Emission"] + layers["Direct"], direct, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(layers["Indirect"], image - direct, atol=1e-5)
    assert layers["Indirect"].max() > 0.01


def test_passes_of_the_first_surface_are_those_of_the_geometry():
    b = scenes.Builder()
    b.quad((-1, -1, 0.5), (1, -1, 0.5), (1, 1, 0.5), (-1, 1, 0.5), scenes.material("sheet", (0.2, 0.4, 0.6)))
    camera = Camera(FROM_ABOVE, (-1.5, 1.5, -1.0, 1.0), 12, 8, kind="orthographic")
    layers = render(b.scene(camera, world=(1.0, 1.0, 1.0)), Render(spp=400, passes=True), MACHINE).film.layers()
    on = np.zeros((8, 12), bool)
    on[:, 2:-2] = True
    np.testing.assert_allclose(layers["Depth"], np.where(on, 1.5, 0), atol=1e-5)
    for name, value in {"Albedo": (0.2, 0.4, 0.6), "Normal": (0, 0, 1)}.items():
        np.testing.assert_allclose(layers[name], np.where(on[..., None], value, 0), atol=1e-5)
    x, y = np.meshgrid((np.arange(12) - 5.5) / 4, (3.5 - np.arange(8)) / 4)
    middles = np.where(on[..., None], np.stack([x, y, np.full_like(x, 0.5)], axis=-1), 0)
    np.testing.assert_allclose(layers["Position"], middles, atol=5 * 0.25 / np.sqrt(12 * 400))  # five sigma of a pixel's mean
    np.testing.assert_allclose(layers["Position"][on][:, 2], 0.5, atol=1e-5)


# --- alpha -------------------------------------------------------------------------------------------------------------


def curtain(share: float, film: Film) -> Result:
    """A white sky of radiance 1, behind a sheet of radiance 3 with a given opacity."""
    closures = Closure("emission", share, {"color": (3.0, 3.0, 3.0)}), Closure("transparent", 1 - share)
    b = scenes.Builder()
    b.quad((-9, 1, -9), (9, 1, -9), (9, 1, 9), (-9, 1, 9), Shader("sheet", (), closures))
    return render(replace(b.scene(OPEN, world=(1.0, 1.0, 1.0)), film=film), Render(spp=4), MACHINE)


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
@pytest.mark.parametrize("exposure", [1.0, 2.0])
def test_a_transparent_film_hides_the_sky(share, exposure):
    shown, hidden = (curtain(share, Film(transparent=transparent, exposure=exposure)) for transparent in (False, True))
    np.testing.assert_allclose(shown.image, exposure * (3 * share + 1 - share), rtol=1e-5)
    np.testing.assert_allclose(hidden.image, exposure * 3 * share, rtol=1e-5)
    np.testing.assert_allclose(hidden.film.alpha(), share, atol=1e-6)


def test_the_hidden_sky_still_gives_light():
    """A white cube in a white sky: alpha is 1 on the cube, 0 beside it."""
    shown = render(scenes.white_cube(24), Render(spp=16, passes=True), MACHINE)
    hidden = render(replace(scenes.white_cube(24), film=Film(transparent=True)), Render(spp=16), MACHINE)
    covered = shown.film.layers()["Albedo"][..., 0]
    assert 0.1 < (covered == 1).mean() < 0.9
    np.testing.assert_allclose(hidden.film.alpha(), covered, atol=1e-6)
    np.testing.assert_allclose(hidden.image, np.broadcast_to(covered[..., None], hidden.image.shape), atol=1e-5)
