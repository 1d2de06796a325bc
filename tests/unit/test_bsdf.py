"""Closures give the right lobes, emission and transparency. Broken input does no harm."""

import numpy as np
import pytest

from blender_rl_guiding.bsdf import lobe, surface
from tests.bsdf import direction, surface_of

UP = direction(0)


def test_a_black_or_hidden_closure_is_no_lobe():
    assert surface_of(("diffuse", {"color": (0, 0, 0)}), wo=UP).count == 0
    assert surface_of(("glossy", {"weight": 0.0}), ("emission", {}), wo=UP).count == 0
    assert surface_of(("principled", {"alpha": 0.0}), wo=UP).count == 0


def test_lobes_are_picked_by_the_luminance_of_their_albedo():
    seen = surface_of(("diffuse", {"color": (0.2, 0.2, 0.2)}), ("translucent", {"color": (0.6, 0.6, 0.6), "weight": 0.5}), wo=UP)
    albedo, guidable, chances = seen.summary()
    np.testing.assert_allclose(chances, [0.4, 0.6], rtol=1e-6)
    np.testing.assert_allclose(albedo, 0.5, rtol=1e-6)
    assert guidable == pytest.approx(0.4)


def test_lobes_beyond_the_last_row_are_left_out():
    """Cycles keeps 64 lobes. With fewer rows, three full Principled BSDFs had too many lobes."""
    coated = {"coat_weight": 0.5, "sheen_weight": 0.5, "metallic": 0.3, "transmission": 0.3, "roughness": 0.3}
    assert surface_of(*[("principled", {"weight": 0.2, **coated})] * 5, wo=UP).count == 30
    seen = surface_of(*[("diffuse", {"weight": 1 / 80})] * 80, wo=UP)
    assert seen.count == surface.LOBES - 1 == 64
    assert seen.summary()[2].sum() == pytest.approx(1)


def test_transparency_and_emission_add_up():
    seen = surface_of(
        ("transparent", {"color": (0.5, 1.0, 1.0), "weight": 0.4}),
        ("principled", {"alpha": 0.25, "weight": 0.6, "emission_color": (1.0, 0.5, 0.0), "emission_strength": 4.0}),
        ("emission", {"color": (0.0, 1.0, 0.0), "strength": 2.0}),
        wo=UP,
    )
    np.testing.assert_allclose(seen.transparency, [0.65, 0.85, 0.85], rtol=1e-6)
    np.testing.assert_allclose(seen.emission, [0.6, 2.3, 0.0], rtol=1e-6)


def test_without_level_principled_is_pure_lambert():
    seen = surface_of(("principled", {"specular_ior_level": 0.0, "base_color": (0.3, 0.6, 0.9)}), wo=direction(70))
    assert seen.count == 1
    assert seen.lobes[0, lobe.KIND] == lobe.DIFFUSE
    np.testing.assert_allclose(seen.summary()[0], [0.3, 0.6, 0.9], rtol=1e-6)


@pytest.mark.parametrize("kind", ["diffuse", "glossy", "glass", "translucent"])
def test_light_crosses_the_geometry_only_by_transmission(kind):
    """As in Cycles, a direction above only one of shading and triangle normal has a value, but is never sampled."""
    ng, n = direction(0), direction(50)
    seen = surface_of((kind, {"roughness": 0.5} if kind in ("glossy", "glass") else {}), wo=direction(30), n=n, ng=ng)
    above, beneath = direction(100), direction(80, 180)
    assert above @ n > 0 > above @ ng
    assert beneath @ n < 0 < beneath @ ng
    f, pdf, guidable = seen.evaluate(np.stack([above, beneath]))
    assert not pdf.any()
    assert not guidable.any()
    assert f.any(axis=1).tolist() == [kind in ("diffuse", "glossy", "glass"), kind == "translucent"]
    wi, label, _ = seen.sample(np.random.default_rng(1).random((1000, 3)))
    assert (((wi @ n > 0) == (wi @ ng > 0)) | (label == 0)).all()


def test_glossy_normals_are_bent_until_they_reflect_upwards():
    wo, leaning = direction(80), tuple(direction(50, 180))
    seen = surface_of(("glossy", {"roughness": 0.0, "normal": leaning}), wo=wo)
    wi, label, _ = seen.sample(np.full((1, 3), 0.5))
    assert (2 * (wo @ leaning) * np.array(leaning) - wo)[2] < 0
    assert label[0] & surface.SINGULAR
    assert wi[0, 2] == pytest.approx(0.01, abs=1e-5)


@pytest.mark.parametrize("kind", ["diffuse", "sheen", "glossy", "metallic", "glass", "principled"])
def test_broken_numbers_stay_numbers(kind):
    """A texture may have NaN. The result may then be NaN, which the film drops. But the process must not crash."""
    for broken in (np.nan, np.inf, -np.inf, -1.0, 1e30):
        seen = surface_of((kind, {"roughness": broken}), wo=direction(40))
        assert 0 <= seen.count < surface.LOBES
        seen.sample(np.full((10, 3), 0.3))
        seen.evaluate(direction(20)[None])
