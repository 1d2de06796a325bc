"""Bundles crafted to make kernels read or write outside of arrays: they are refused, or render to the end."""

import random
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.render import render
from blender_rl_guiding.scene.bundle import load, save
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import IDENTITY, Closure, Instruction, Node, Shader
from blender_rl_guiding.scene.faults import find_fault
from blender_rl_guiding.settings import BSDF, Machine, QTable, Render, Uniform
from blender_rl_guiding.shading.program import compile_shaders
from tests.bundles import changed, lamp, misdescribed, painted, refusal, rewrite, shader, spoiled, whole

NAN = float("nan")


@pytest.fixture
def scene() -> SceneData:
    return whole()


def camera(s: SceneData, **values: Any) -> dict[str, Any]:
    return {"camera": replace(s.camera, **values)}


INT64 = np.iinfo(np.int64)
OUTSIDE = {
    "attribute rows that end beyond the last": lambda s: {"attribute_rows": changed(s.attribute_rows, (0, 1), 273)},
    "attribute rows whose end wraps round": lambda s: {"attribute_rows": changed(s.attribute_rows, (0, 1), INT64.max)},
    "all of them": lambda s: {"attribute_rows": np.full_like(s.attribute_rows, INT64.max - 100)},
    "the least of them": lambda s: {"attribute_rows": changed(s.attribute_rows, (1, 2), INT64.min)},
    "meshes whose steps wrap round": lambda s: {"meshes": np.int32([len(s.object), 2**31 - 1, -(2**31) + 5, len(s.object) + 6])},
    "more rows than kernels count": lambda s: {"attribute_rows": np.zeros((2**31, 0), np.int64)},
    "kinds of rays that there are not": lambda s: {"visibility": changed(s.visibility, 1, 32)},
    "a vertex beyond what Embree sees": lambda s: {"vertices": changed(s.vertices, (3, 1), 2e18)},
    "an instance beyond it": lambda s: {"instance_to_world": changed(s.instance_to_world, (0, 0, 3), -3e38)},
    "a camera beyond it": lambda s: camera(s, to_world=placed(1e19)),
    "a lamp beyond it": lambda s: lamp(s, to_world=placed(-1e19)),
    "a window that is wider than any number": lambda s: camera(s, window=(-3e38, 3e38, -1.0, 1.0)),
    "half of a character": lambda s: {"name": "a\ud800"},
    "bounces without end": lambda s: {"bounces": replace(s.bounces, transparent=10**30)},
    "more blades than anybody has": lambda s: camera(s, blades=10**30),
    "a turn that is none": lambda s: camera(s, blade_rotation=NAN),
    "a world seen by all integers": lambda s: {"world_visibility": 10**30},
    "a weight beyond single precision": lambda s: shader(s, closures=(Closure("diffuse", 1e39),)),
    "an option below 0": lambda s: shader(s, code=(Instruction("attribute", options=(-1,)),)),
    "a tile with a number beyond the last": lambda s: {"textures": (s.textures[0], replace(s.textures[1], tile=10**10))},
}


def placed(x: float) -> tuple[tuple[float, ...], ...]:
    """The matrix of a shift along x."""
    return ((1.0, 0.0, 0.0, x), *IDENTITY[1:])


@pytest.mark.parametrize("fault", OUTSIDE)
def test_what_would_lead_out_of_arrays_is_refused_by_writer_and_reader(scene, tmp_path, fault):
    bad = replace(scene, **OUTSIDE[fault](scene))
    text = find_fault(bad)
    assert text
    assert "\n" not in text
    save(bad, tmp_path / "bad.npz")
    assert text in refusal(tmp_path / "bad.npz")


def test_scenes_without_attributes_need_no_table_of_them(scene, tmp_path):
    """The default table has no columns either."""
    for shape in ((0, 0), (0, len(scene.visibility))):
        plain = replace(scene, shaders=scene.shaders[:1] * len(scene.shaders), attribute_rows=np.zeros(shape, np.int64))
        save(plain, tmp_path / "scene.npz")
        assert load(tmp_path / "scene.npz").key == plain.key
        compile_shaders(plain)


def test_whatever_number_a_bundle_has_it_loads_or_is_refused_in_a_line(tmp_path):
    """Extremes in arrays and in the header, drawn with fixed seeds."""
    path, outcomes = tmp_path / "scene.npz", []
    for seed in range(200):
        rng = random.Random(seed)
        scene = (whole(), painted())[seed % 2]
        rewrite(scene, path, **(spoiled(scene, rng) if seed % 3 else {"header": misdescribed(scene, rng)}))
        try:
            outcomes.append(find_fault(load(path)))
        except InputError as error:
            assert "\n" not in str(error)  # noqa: PT017  # either outcome is right
            outcomes.append(str(error))
    assert 30 < outcomes.count("") < 170  # `save` would refuse some of the bundles that `load` accepts


# --- and rendered ------------------------------------------------------------------------------------------------------

GUIDES = BSDF(), Uniform(), QTable(rows=2, columns=3, cells=8, levels=2, recorded=1000)


def test_what_loads_renders_to_an_end(tmp_path):
    """A finite image, or one line. NUMBA_BOUNDSCHECK=1 checks every index: see `kernels`."""
    path, ends = tmp_path / "scene.npz", Counter()
    for seed in range(1110, 1140):
        rng = random.Random(seed)
        scene = (whole(), painted())[seed % 2]
        rewrite(scene, path, **(spoiled(scene, rng) if seed % 3 else {"header": misdescribed(scene, rng)}))
        try:
            loaded = load(path)
            if loaded.camera.width * loaded.camera.height > 100:
                continue
            settings = Render(spp=3, nee=seed % 4 > 0, guide=GUIDES[seed % 3], passes=seed % 5 == 0)
            assert np.isfinite(render(loaded, settings, Machine(threads=1)).image).all()
            ends["image"] += 1
        except (InputError, FloatingPointError) as error:
            assert "\n" not in str(error)  # noqa: PT017  # either outcome is right
            ends[type(error).__name__] += 1
    assert ends["image"] > 5


BRIGHT = (Closure("emission", 3e38, {"strength": 3e38}),)
ENDLESS = {
    "lamp 'lamp'": lambda s: {
        "shaders": (*s.shaders, Shader("", (), (Closure("emission", 3e38),))),
        "lamps": (replace(s.lamps[0], emission=(3e38, 1.0, 1.0), shader=len(s.shaders)),),
    },
    "shader 'lamp'": lambda s: shader(s, 3, closures=BRIGHT),
    "the world's shader 'sky'": lambda s: {
        "world": replace(s.world, closures=(Closure("emission", 3e38, {"color": Node(0), "strength": 3e38}),))
    },
}


@pytest.mark.parametrize("light", ENDLESS)
def test_a_light_without_end_is_named(scene, light):
    """Infinite powers have no shares."""
    with pytest.raises(InputError, match=f"{light} sends out more light than can be counted"):
        render(replace(scene, **ENDLESS[light](scene)), Render(spp=1), Machine(threads=1))
