"""Who sees what: the kinds of rays that lobes make, and what Blender's switches hide from them."""

import numpy as np
import pytest

from blender_rl_guiding.scene.description import VISIBLE
from blender_rl_guiding.scene.ray_kinds import DIFFUSE, EMITTERS, GLOSSY, MESHES, TRANSLUCENT, TRANSMISSION, WORLD, seen_by
from tests.bsdf import direction, surface_of


@pytest.mark.parametrize(("switches", "hidden_by"), [(MESHES, [TRANSMISSION]), (EMITTERS, [DIFFUSE]), (WORLD, [DIFFUSE, TRANSMISSION])])
def test_translucent_rays_see_what_the_switches_let_them(switches, hidden_by):
    kinds = np.array([VISIBLE, VISIBLE - DIFFUSE, VISIBLE - GLOSSY, VISIBLE - TRANSMISSION], np.uint8)
    expected = [bit not in hidden_by for bit in (None, DIFFUSE, GLOSSY, TRANSMISSION)]
    seen = seen_by(kinds, switches)
    assert ((seen & TRANSLUCENT) > 0).tolist() == expected
    np.testing.assert_array_equal(seen & VISIBLE, kinds)
    assert [seen_by(int(kind), switches) for kind in kinds] == seen.tolist()


@pytest.mark.parametrize(
    ("closure", "expected"),
    [
        ("diffuse", {DIFFUSE}),
        ("sheen", {DIFFUSE}),
        ("glossy", {GLOSSY}),
        ("refraction", {TRANSMISSION}),
        ("glass", {GLOSSY, TRANSMISSION}),
        ("translucent", {TRANSLUCENT}),
    ],
)
def test_every_ray_is_of_one_kind(closure, expected):
    rough = {"roughness": 0.5} if closure not in ("diffuse", "translucent") else {}
    _, label, _ = surface_of((closure, rough), wo=direction(20)).sample(np.random.default_rng(1).random((1000, 3)))
    assert set(label[label > 0]) == expected
