"""Scene bundles: what is written is read again, the key follows what the image depends on, and every fault is one line that names it."""

import io
import json
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import Loss, SceneData, find_fault, load, save
from tests import scenes

ARRAYS = ("vertices", "triangles", "normals", "material")


@pytest.fixture
def scene() -> SceneData:
    return replace(scenes.tiny(4), coverage=(Loss("Lamp", "node 'Mix'", "left out"),))


def changed(array: np.ndarray, index: Any, value: Any) -> np.ndarray:
    new = array.copy()
    new[index] = value
    return new


def refusal(path: Path) -> str:
    """What `load` says of a bundle that it must refuse, after a check that it is one line that names the file."""
    with pytest.raises(InputError) as info:
        load(path)
    text = str(info.value)
    assert str(path) in text
    assert "\n" not in text
    return text


# --- round trip and key ----------------------------------------------------------------------------------------------


def test_round_trip(scene, tmp_path):
    save(scene, tmp_path / "new" / "scene.npz")
    again = load(tmp_path / "new" / "scene.npz")
    for name in ("name", "materials", "camera", "world", "max_bounces", "coverage", "key"):
        assert getattr(again, name) == getattr(scene, name)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(again, name), getattr(scene, name))
        assert getattr(again, name).dtype == getattr(scene, name).dtype
        assert not getattr(again, name).flags.writeable
    assert [p.name for p in (tmp_path / "new").iterdir()] == ["scene.npz"]


def test_key_ignores_names_and_coverage(scene):
    renamed = tuple(replace(m, name=f"{m.name}!") for m in scene.materials)
    assert replace(scene, name="other", materials=renamed, coverage=()).key == scene.key


CHANGES = {
    "vertex": lambda s: {"vertices": changed(s.vertices, (5, 1), np.nextafter(s.vertices[5, 1], np.float32(9)))},
    "triangle": lambda s: {"triangles": changed(s.triangles, 0, s.triangles[0][::-1])},
    "normal": lambda s: {"normals": changed(s.normals, (0, 0, 0), 0.25)},
    "material index": lambda s: {"material": changed(s.material, 0, 1)},
    "albedo": lambda s: {"materials": (replace(s.materials[0], base_color=(0.8, 0.3, 0.21)), *s.materials[1:])},
    "emission": lambda s: {"materials": (replace(s.materials[0], emission=(0.0, 0.0, 0.01)), *s.materials[1:])},
    "position": lambda s: {"camera": replace(s.camera, to_world=((1.0, 0.0, 0.0, 9.0), *s.camera.to_world[1:]))},
    "lens": lambda s: {"camera": replace(s.camera, tan_x=s.camera.tan_x * 1.001)},
    "resolution": lambda s: {"camera": replace(s.camera, width=5)},
    "world": lambda s: {"world": (0.0, 0.0, 1e-6)},
    "bounces": lambda s: {"max_bounces": s.max_bounces + 1},
}


@pytest.mark.parametrize("change", CHANGES)
def test_key_changes_with_all_that_the_image_depends_on(scene, change):
    assert replace(scene, **CHANGES[change](scene)).key != scene.key


def test_failed_save_leaves_the_old_bundle(scene, tmp_path, monkeypatch):
    path = tmp_path / "scene.npz"
    save(scene, path)

    def full(file: io.BufferedWriter, **arrays: Any) -> None:
        file.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(InputError, match=r"^cannot write .*scene\.npz: No space left on device$"):
        save(replace(scene, max_bounces=1), path)
    assert load(path).key == scene.key
    assert [p.name for p in tmp_path.iterdir()] == ["scene.npz"]


def test_save_below_a_file_is_refused(scene, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"^cannot write .*file/scene\.npz: "):
        save(scene, tmp_path / "file" / "scene.npz")


# --- damaged files ---------------------------------------------------------------------------------------------------


def test_truncated_bundles_are_refused(scene, tmp_path):
    save(scene, tmp_path / "whole.npz")
    data = (tmp_path / "whole.npz").read_bytes()
    path = tmp_path / "cut.npz"
    for length in [0, 1, 3, 4, 10, 100, *range(200, len(data), len(data) // 97), len(data) - 1]:
        path.write_bytes(data[:length])
        refusal(path)


def test_changed_bytes_are_refused_or_harmless(scene, tmp_path):
    """The checksums of the zip find damage within arrays; what is left is the directory's padding and dates."""
    save(scene, tmp_path / "whole.npz")
    data, path, rng = (tmp_path / "whole.npz").read_bytes(), tmp_path / "bad.npz", np.random.default_rng(1)
    for at in rng.integers(len(data), size=300):
        path.write_bytes(data[:at] + bytes([data[at] ^ 0x55]) + data[at + 1 :])
        try:
            assert load(path).key == scene.key
        except InputError as error:
            assert "\n" not in str(error)  # noqa: PT017  # either outcome is right


@pytest.mark.parametrize("content", [b"not a bundle", b"PK\x05\x06" + bytes(18), b"\x93NUMPY\x01\x00", b"\x80\x04N."])
def test_other_files_are_refused(content, tmp_path):
    path = tmp_path / "scene.npz"
    path.write_bytes(content)
    refusal(path)


def test_a_single_array_is_refused(tmp_path):
    np.save(tmp_path / "scene.npy", np.zeros(3))
    refusal(tmp_path / "scene.npy")


def test_missing_files_and_folders_are_named(tmp_path):
    assert refusal(tmp_path / "none.npz").endswith("No such file or directory")
    assert refusal(tmp_path).endswith("Is a directory")


class Attack:
    """Runs code where it is unpickled."""

    def __reduce__(self) -> tuple:
        return (Path.touch, (Path("/tmp/rlg-unpickled"),))


def test_pickled_objects_are_refused(scene, tmp_path):
    rewrite(scene, tmp_path / "scene.npz", vertices=np.array([Attack()], object))
    assert "allow_pickle" in refusal(tmp_path / "scene.npz")
    assert not Path("/tmp/rlg-unpickled").exists()


def rewrite(scene: SceneData, path: Path, header: Any = None, **arrays: Any) -> None:
    """Write a bundle in which the header's values or arrays are replaced, or left out where None."""
    save(scene, path)
    with np.load(path) as file:
        content = {name: file[name] for name in file.files}
    values = json.loads(str(content["header"])) | (header or {})
    content["header"] = np.array(json.dumps(values))
    np.savez(path, **{k: v for k, v in (content | arrays).items() if v is not None})


BAD_ARRAYS = {
    "vertices": np.zeros((3, 3), np.float64),
    "triangles": np.zeros((3, 3), np.int64),
    "normals": np.zeros((3, 3), np.float32),
    "material": np.zeros((3, 1), np.int32),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_missing_and_mistyped_arrays_are_named(scene, tmp_path, name):
    rewrite(scene, tmp_path / "scene.npz", **{name: None})
    assert name in refusal(tmp_path / "scene.npz")
    rewrite(scene, tmp_path / "scene.npz", **{name: BAD_ARRAYS[name]})
    assert name in refusal(tmp_path / "scene.npz")
    rewrite(scene, tmp_path / "scene.npz", **{name: np.array(3, BAD_ARRAYS[name].dtype)})
    refusal(tmp_path / "scene.npz")


@pytest.mark.parametrize("text", ["", "{", "[]", "null", '"x"', "{}", '{"version": 1}'])
def test_bad_json_is_refused(scene, tmp_path, text):
    rewrite(scene, tmp_path / "scene.npz")
    with np.load(tmp_path / "scene.npz") as file:
        arrays = {name: file[name] for name in ARRAYS}
    np.savez(tmp_path / "scene.npz", header=np.array(text), **arrays)
    refusal(tmp_path / "scene.npz")


CAMERA = {"to_world": np.eye(4).tolist(), "tan_x": 1.0, "tan_y": 1.0, "width": 4, "height": 4}
BAD_HEADERS = {
    "ragged matrix": {"camera": CAMERA | {"to_world": [[1, 0], [0]]}},
    "version 2": {"version": 2},
    "camera": {"camera": None},
    "camera without a lens": {"camera": CAMERA | {"tan_x": None}},
    "camera matrix": {"camera": CAMERA | {"to_world": 3}},
    "half a pixel": {"camera": CAMERA | {"width": 4.5}},
    "world": {"world": [1, 2]},
    "world of words": {"world": ["a", "b", "c"]},
    "material": {"materials": [{"name": "x"}]},
    "materials": {"materials": 3},
    "bounces": {"max_bounces": "many"},
    "half a bounce": {"max_bounces": 0.5},
    "coverage": {"coverage": [{"thing": "x"}]},
}


@pytest.mark.parametrize("fault", BAD_HEADERS)
def test_bad_headers_are_refused(scene, tmp_path, fault):
    rewrite(scene, tmp_path / "scene.npz", header=BAD_HEADERS[fault])
    refusal(tmp_path / "scene.npz")


def test_another_version_is_named(scene, tmp_path):
    rewrite(scene, tmp_path / "scene.npz", header={"version": 2})
    assert "version 2" in refusal(tmp_path / "scene.npz")


def test_compressed_bundles_are_read(scene, tmp_path):
    save(scene, tmp_path / "stored.npz")
    with zipfile.ZipFile(tmp_path / "stored.npz") as old, zipfile.ZipFile(tmp_path / "packed.npz", "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            new.writestr(name, old.read(name))
    assert load(tmp_path / "packed.npz").key == scene.key


# --- scenes that cannot be rendered ------------------------------------------------------------------------------------

EMPTY = {"triangles": np.zeros((0, 3), np.int32), "normals": np.zeros((0, 3, 3), np.float32), "material": np.zeros(0, np.int32)}


def bad_material(s: SceneData, **values: Any) -> dict[str, Any]:
    return {"materials": (*s.materials[:1], replace(s.materials[1], **values), *s.materials[2:])}


def bad_camera(s: SceneData, **values: Any) -> dict[str, Any]:
    return {"camera": replace(s.camera, **values)}


FAULTS = {
    "the scene is empty": lambda s: EMPTY,
    "vertices -1..": lambda s: {"triangles": changed(s.triangles, (3, 1), -1)},
    "..99999, but there are": lambda s: {"triangles": changed(s.triangles, (3, 1), 99999)},
    "material indices": lambda s: {"material": s.material[:-1]},
    "normals": lambda s: {"normals": s.normals[:-1]},
    "materials -1..": lambda s: {"material": changed(s.material, 2, -1)},
    "materials 0..7": lambda s: {"material": changed(s.material, 2, 7)},
    "triangle 4 has a vertex": lambda s: {"vertices": changed(s.vertices, (s.triangles[4, 0], 2), np.nan)},
    "triangle 3 has a vertex": lambda s: {"vertices": changed(s.vertices, (s.triangles[3, 2], 0), np.inf)},
    "triangle 5 has a vertex or normal": lambda s: {"normals": changed(s.normals, (5, 1, 2), np.nan)},
    "triangle 6 is degenerate": lambda s: {"triangles": changed(s.triangles, (6, 1), s.triangles[6, 0])},
    "base_color (2": lambda s: bad_material(s, base_color=(2.0, 0.0, 0.0)),
    "base_color (-0.1": lambda s: bad_material(s, base_color=(-0.1, 0.0, 0.0)),
    "emission (nan": lambda s: bad_material(s, emission=(float("nan"), 0.0, 0.0)),
    "emission (0.0, -1.0": lambda s: bad_material(s, emission=(0.0, -1.0, 0.0)),
    "tan_x 0": lambda s: bad_camera(s, tan_x=0.0),
    "tan_y nan": lambda s: bad_camera(s, tan_y=float("nan")),
    "not a pinhole": lambda s: bad_camera(s, to_world=((1.0, 0.0), (0.0, 1.0))),
    "resolution 0 x 4": lambda s: bad_camera(s, width=0),
    "resolution 4 x 99999": lambda s: bad_camera(s, height=99999),
    "world (-1": lambda s: {"world": (-1.0, 0.0, 0.0)},
    "world (inf": lambda s: {"world": (float("inf"), 0.0, 0.0)},
    "max_bounces -1": lambda s: {"max_bounces": -1},
    "no light": lambda s: {"materials": tuple(replace(m, emission=(0.0, 0.0, 0.0)) for m in s.materials)},
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_found_and_named(scene, tmp_path, fault):
    bad = replace(scene, **FAULTS[fault](scene))
    text = find_fault(bad)
    assert fault in text
    assert "\n" not in text
    save(bad, tmp_path / "bad.npz")
    assert refusal(tmp_path / "bad.npz").endswith(text)


def test_a_good_scene_has_no_fault(scene):
    assert find_fault(scene) == ""
    dark = tuple(replace(m, emission=(0.0, 0.0, 0.0)) for m in scene.materials)
    assert find_fault(replace(scene, materials=dark, world=(0.0, 0.0, 0.1))) == ""


def test_an_emitter_that_no_triangle_has_is_no_light(scene):
    dark = tuple(replace(m, emission=(0.0, 0.0, 0.0)) for m in scene.materials)
    unused = replace(dark[0], emission=(1.0, 1.0, 1.0))
    assert "no light" in find_fault(replace(scene, materials=(*dark, unused)))
