"""The kinds of rays that lobes give, and the things that Blender's switches hide from each kind."""

import numpy as np
import pytest

from blender_rl_guiding.lights.emitters import lights
from blender_rl_guiding.scene.description import VISIBLE, Closure, Instruction, Node, Shader
from blender_rl_guiding.scene.ray_kinds import DIFFUSE, EMITTERS, GLOSSY, MESHES, TRANSLUCENT, TRANSMISSION, WORLD, seen_by
from blender_rl_guiding.shading.program import compile_shaders
from blender_rl_guiding.tracing.geometry import Geometry
from tests import scenes
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


@pytest.mark.parametrize(("mode", "sampled"), [("IS_CAMERA_RAY", True), ("IS_DIFFUSE_RAY", False), ("IS_TRANSMISSION_RAY", False)])
def test_what_shines_for_some_scattered_rays_is_not_sampled(mode, sampled):
    """Light sampling does not know the kind of the scattered ray that would hit the light."""
    ray = Instruction("light_path", mode=mode)
    not_ray = Instruction("math", (1.0, Node(0), 0.0), "SUBTRACT", (0,))
    glow = Shader("glow", (ray, not_ray), (Closure("emission", 1.0, {"strength": Node(1)}),))
    builder = scenes.Builder()
    builder.quad((-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1), glow)
    scene = builder.scene(scenes.look((0, 0, 0), (0, 1, 0), 90, 8, 8))
    found = lights(scene, compile_shaders(scene), Geometry(scene).surface)
    assert (len(found.triangle) == 2) == sampled
    assert found.pdf_area.any() == sampled
