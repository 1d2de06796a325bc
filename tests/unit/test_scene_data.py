"""Scene bundles: reading returns the written scene. The key depends on everything that the image depends on."""

import io
import pickle
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.bundle import load, save
from blender_rl_guiding.scene.data import ARRAYS, SceneData, Texture
from blender_rl_guiding.scene.description import Closure, Instruction, Node
from tests.bundles import changed, lamp, shader, whole


@pytest.fixture
def scene() -> SceneData:
    return whole()


def test_round_trip(scene, tmp_path):
    save(scene, tmp_path / "new" / "scene.npz")
    again = load(tmp_path / "new" / "scene.npz")
    for name in {f.name for f in fields(SceneData)} - ARRAYS.keys() - {"textures"}:
        assert getattr(again, name) == getattr(scene, name), name
    for name in ARRAYS:
        assert_same_array(getattr(again, name), getattr(scene, name))
    assert again.textures == scene.textures  # compares names and colour coding
    for ours, theirs in zip(again.textures, scene.textures, strict=True):
        assert_same_array(ours.texels, theirs.texels)
    assert again.key == scene.key
    assert [p.name for p in (tmp_path / "new").iterdir()] == ["scene.npz"]


def test_a_scene_sent_to_another_process_is_as_it_was(scene):
    again = pickle.loads(pickle.dumps(scene))
    for name in ARRAYS:
        assert_same_array(getattr(again, name), getattr(scene, name))
    for ours, theirs in zip(again.textures, scene.textures, strict=True):
        assert_same_array(ours.texels, theirs.texels)
    assert again.key == scene.key


def assert_same_array(a: np.ndarray, b: np.ndarray) -> None:
    """Equal bits, equal types, and read-only."""
    np.testing.assert_array_equal(a, b)
    assert a.dtype == b.dtype
    assert not a.flags.writeable


def test_key_ignores_names_and_coverage(scene):
    named = {
        "name": "other",
        "coverage": (),
        "shaders": tuple(replace(s, name=f"{s.name}!") for s in scene.shaders),
        "world": replace(scene.world, name="heaven"),
        "lamps": tuple(replace(lamp, name="") for lamp in scene.lamps),
        "textures": tuple(replace(t, name="") for t in scene.textures),
    }
    assert replace(scene, **named).key == scene.key


def nudged(scene: SceneData, name: str) -> dict[str, np.ndarray]:
    """An argument of `replace`: the array, with the last number changed by the smallest step."""
    array = getattr(scene, name)
    index = tuple(np.array(array.shape) - 1)
    return {name: changed(array, index, np.nextafter(array[index], np.float32(9)) if array.dtype == np.float32 else array[index] ^ 1)}


CHANGES = {
    **{name: lambda s, name=name: nudged(s, name) for name in ARRAYS},
    "order of corners": lambda s: {"triangles": changed(s.triangles, 0, s.triangles[0][::-1])},
    "albedo": lambda s: shader(s, closures=(Closure("diffuse", 1.0, {"color": (0.8, 0.3, 0.21)}),)),
    "emission": lambda s: shader(s, closures=(*s.shaders[0].closures, Closure("emission", 1e-6))),
    "weight": lambda s: shader(s, closures=(replace(s.shaders[0].closures[0], weight=0.999),)),
    "instruction": lambda s: shader(s, 0, code=(Instruction("normal"),)),
    "mode": lambda s: shader(s, 1, code=(*s.shaders[1].code[:2], replace(s.shaders[1].code[2], mode="COLOR"), *s.shaders[1].code[3:])),
    "option": lambda s: shader(s, 1, code=(replace(s.shaders[1].code[0], options=(1,)), *s.shaders[1].code[1:])),
    "node": lambda s: shader(s, 1, closures=(Closure("diffuse", 1.0, {"color": Node(0)}),)),
    "position": lambda s: {"camera": replace(s.camera, to_world=((1.0, 0.0, 0.0, 9.0), *s.camera.to_world[1:]))},
    "lens": lambda s: {"camera": replace(s.camera, window=(-1.0, 1.0, -1.0, 1.001))},
    "resolution": lambda s: {"camera": replace(s.camera, width=5)},
    "aperture": lambda s: {"camera": replace(s.camera, aperture=0.01)},
    "world": lambda s: {"world": replace(s.world, closures=(Closure("emission", 1.0, {"strength": 1e-6}),))},
    "lamp": lambda s: lamp(s, radius=0.11),
    "lamp's shadow": lambda s: lamp(s, shadow=False),
    "lamp's shader": lambda s: lamp(s, shader=0),
    "tile": lambda s: {"textures": (replace(s.textures[0], tile=1001), *s.textures[1:])},
    "filter": lambda s: {"film": replace(s.film, filter="gaussian")},
    "exposure": lambda s: {"film": replace(s.film, exposure=1.01)},
    "bounces": lambda s: {"bounces": replace(s.bounces, glossy=s.bounces.glossy + 1)},
    "texel": lambda s: {"textures": (replace(s.textures[0], texels=changed(s.textures[0].texels, (0, 0, 3), 7)), *s.textures[1:])},
    "coding": lambda s: {"textures": (replace(s.textures[0], srgb=False), *s.textures[1:])},
    "order of textures": lambda s: {"textures": s.textures[::-1]},
}


@pytest.mark.parametrize("change", CHANGES)
def test_key_changes_with_all_that_the_image_depends_on(scene, change):
    assert replace(scene, **CHANGES[change](scene)).key != scene.key


def test_key_tells_shapes_and_types_apart(scene):
    texels = scene.textures[0].texels
    wide, high = (replace(scene, textures=(Texture("", True, texels.reshape(shape)),)) for shape in ((1, -1, 4), (-1, 1, 4)))
    assert wide.key != high.key
    floats = np.zeros((1, 1, 4), np.float32)
    assert (
        replace(scene, textures=(Texture("", True, floats),)).key
        != replace(scene, textures=(Texture("", True, floats.view(np.uint8).reshape(1, 4, 4)),)).key
    )


# --- writing -----------------------------------------------------------------------------------------------------------


def test_failed_save_leaves_the_old_bundle(scene, tmp_path, monkeypatch):
    path = tmp_path / "scene.npz"
    save(scene, path)

    def full(file: io.BufferedWriter, **arrays: Any) -> None:
        file.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(InputError, match=r"^cannot write .*scene\.npz: No space left on device$"):
        save(replace(scene, name="new"), path)
    assert load(path).name == scene.name
    assert [p.name for p in tmp_path.iterdir()] == ["scene.npz"]


def test_save_below_a_file_is_refused(scene, tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"^cannot write .*file/scene\.npz: "):
        save(scene, tmp_path / "file" / "scene.npz")
