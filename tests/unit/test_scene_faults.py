"""Damaged bundles, and bundles that cannot be rendered, are refused in one line that names the file and the fault."""

import json
import zipfile
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.bundle import VERSION, load, save
from blender_rl_guiding.scene.data import ARRAYS, SceneData, Texture
from blender_rl_guiding.scene.description import DIFFUSE, IDENTITY, VISIBLE, Closure, Film, Instruction, Lamp, Node, Shader, emits
from blender_rl_guiding.scene.faults import find_fault, find_nothing, without_area
from tests import scenes
from tests.bundles import changed, lamp, refusal, rewrite, shader, whole

NAN, INF = float("nan"), float("inf")


@pytest.fixture
def scene() -> SceneData:
    return whole()


# --- damaged files ---------------------------------------------------------------------------------------------------


def test_truncated_bundles_are_refused(scene, tmp_path):
    save(scene, tmp_path / "whole.npz")
    data = (tmp_path / "whole.npz").read_bytes()
    path = tmp_path / "cut.npz"
    for length in [0, 1, 3, 4, 10, 100, *range(200, len(data), len(data) // 97), len(data) - 1]:
        path.write_bytes(data[:length])
        refusal(path)


def test_changed_bytes_are_refused_or_harmless(scene, tmp_path):
    """The checksums of the zip find damage in arrays. Only changes of padding and of dates in the directory stay undetected."""
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
    """An object that runs code when it is unpickled."""

    def __init__(self, witness: Path) -> None:
        self.witness = witness

    def __reduce__(self) -> tuple:
        return (Path.touch, (self.witness,))


def test_pickled_objects_are_refused(scene, tmp_path):
    rewrite(scene, tmp_path / "scene.npz", vertices=np.array([Attack(tmp_path / "unpickled")], object))
    assert "allow_pickle" in refusal(tmp_path / "scene.npz")
    assert not (tmp_path / "unpickled").exists()


@pytest.mark.parametrize("name", ARRAYS)
def test_missing_and_mistyped_arrays_are_named(scene, tmp_path, name):
    path, array = tmp_path / "scene.npz", getattr(scene, name)
    other = np.float64 if array.dtype == np.float32 else np.int16
    for bad in (None, array.astype(other), array[None], np.array(3, array.dtype)):
        rewrite(scene, path, **{name: bad})
        assert name in refusal(path)
    if array.ndim == 3:
        rewrite(scene, path, **{name: array[..., :2]})
        assert name in refusal(path)


BAD_TEXELS = [None, *(np.zeros(shape, np.uint8) for shape in ((2, 2, 3), (2, 4), (0, 2, 4))), np.zeros((2, 2, 4), np.uint16)]


@pytest.mark.parametrize("texels", BAD_TEXELS, ids=lambda t: "none" if t is None else f"{t.dtype}{t.shape}")
def test_missing_and_mistyped_textures_are_named(scene, tmp_path, texels):
    rewrite(scene, tmp_path / "scene.npz", texture_1=texels)
    assert "texture_1" in refusal(tmp_path / "scene.npz")


@pytest.mark.parametrize("text", ["", "{", "[]", "null", '"x"', "{}", f'{{"version": {VERSION}}}'])
def test_bad_json_is_refused(scene, tmp_path, text):
    np.savez(tmp_path / "scene.npz", header=np.array(text), **{name: getattr(scene, name) for name in ARRAYS})
    refusal(tmp_path / "scene.npz")


def altered(part: str, index: int | None = None, **values: Any) -> Any:
    """A part of the header, or one entry of this part, with other values. A value of None is left out."""
    header = json.loads(json.dumps(whole().header()))
    entry = header[part] if index is None else header[part][index]
    entry.update(values)
    for name in [name for name, value in values.items() if value is None]:
        del entry[name]
    return {part: header[part]}


BAD_HEADERS = {
    "ragged matrix": altered("camera", to_world=[[1, 0], 0]),
    "camera": {"camera": None},
    "camera without a window": altered("camera", window=None),
    "camera with more": altered("camera", zoom=2),
    "camera matrix": altered("camera", to_world=3),
    "camera kind": altered("camera", kind=3),
    "half a pixel": altered("camera", width=4.5),
    "window of three": altered("camera", window=[1.0, 1.0, 1.0]),
    "window of words": altered("camera", window=["a", "b", "c", "d"]),
    "world": {"world": [1, 2]},
    "world without code": altered("world", code=None),
    "shader": altered("shaders", 0, closures=3),
    "shaders": {"shaders": 3},
    "unknown closure": altered("shaders", 0, closures=[asdict(Closure("diffuse", 1.0)) | {"kind": "fur"}]),
    "unknown input": altered("shaders", 0, closures=[{"kind": "diffuse", "weight": 1.0, "inputs": {"colour": 1.0}}]),
    "weight of a word": altered("shaders", 0, closures=[{"kind": "diffuse", "weight": "much", "inputs": {}}]),
    "colour of two": altered("shaders", 0, closures=[{"kind": "diffuse", "weight": 1.0, "inputs": {"color": [1.0, 1.0]}}]),
    "node of a word": altered("shaders", 0, closures=[{"kind": "diffuse", "weight": {"index": "first"}, "inputs": {}}]),
    "instruction": altered("shaders", 0, code=[{"op": "math"}]),
    "option of half": altered("shaders", 0, code=[asdict(Instruction("attribute")) | {"options": [0.5]}]),
    "lamp": altered("lamps", 0, emission=1.0),
    "lamp without kind": altered("lamps", 0, kind=None),
    "film": altered("film", transparent=1),
    "bounces": altered("bounces", total="many"),
    "half a bounce": altered("bounces", total=0.5),
    "textures": {"textures": [3]},
    "one texture too many": {"textures": [{"name": "x", "srgb": False}] * 3},
    "coverage": {"coverage": [{"thing": "x"}]},
}


@pytest.mark.parametrize("fault", BAD_HEADERS)
def test_bad_headers_are_refused(scene, tmp_path, fault):
    rewrite(scene, tmp_path / "scene.npz", header=BAD_HEADERS[fault])
    refusal(tmp_path / "scene.npz")


@pytest.mark.parametrize("version", [1, VERSION + 1])
def test_another_version_is_named(scene, tmp_path, version):
    rewrite(scene, tmp_path / "scene.npz", header={"version": version})
    assert f"version {version}" in refusal(tmp_path / "scene.npz")


def test_compressed_bundles_are_read(scene, tmp_path):
    save(scene, tmp_path / "stored.npz")
    with zipfile.ZipFile(tmp_path / "stored.npz") as old, zipfile.ZipFile(tmp_path / "packed.npz", "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            new.writestr(name, old.read(name))
    assert load(tmp_path / "packed.npz").key == scene.key


# --- scenes that cannot be rendered ------------------------------------------------------------------------------------

FLAT = ((1.0, 0.0), (0.0, 1.0))


def camera(s: SceneData, **values: Any) -> dict[str, Any]:
    return {"camera": replace(s.camera, **values)}


def texture(s: SceneData, index: tuple[int, int, int], value: float) -> dict[str, Any]:
    """An argument of `replace`: the textures, with another value in the float texture."""
    codes, light = s.textures
    return {"textures": (codes, replace(light, texels=changed(light.texels, index, value)))}


def unlit(s: SceneData) -> dict[str, Any]:
    """An argument of `replace`: no lamps, and no shaders that emit."""
    dark = tuple(replace(part, closures=tuple(c for c in part.closures if not emits(c))) for part in s.shaders)
    return {"shaders": dark, "world": Shader(""), "lamps": ()}


FAULTS = {
    "vertices -1..": lambda s: {"triangles": changed(s.triangles, (3, 1), -1)},
    "..99999, but there are": lambda s: {"triangles": changed(s.triangles, (3, 1), 99999)},
    "in material": lambda s: {"material": s.material[:-1]},
    "in normals": lambda s: {"normals": s.normals[:-1]},
    "in object": lambda s: {"object": s.object[:-1]},
    "materials -1..": lambda s: {"material": changed(s.material, 2, -1)},
    "materials 0..7": lambda s: {"material": changed(s.material, 2, 7)},
    "objects -1..1 of 2": lambda s: {"object": changed(s.object, 0, -1)},
    "objects 0..2 of 2": lambda s: {"object": changed(s.object, -1, 2)},
    "which must never fall": lambda s: {"object": s.object[::-1].copy()},
    "object_attributes of 4": lambda s: {"object_attributes": np.zeros((1, 4, 3), np.float32)},
    "attribute_rows (1, 4)": lambda s: {"attribute_rows": np.zeros((1, 4), np.int64)},
    "attribute_rows (2, 3)": lambda s: {"attribute_rows": changed(s.attribute_rows, (0, 0), -2)},
    "rows of attributes": lambda s: {"attributes": s.attributes[: len(s.triangles) // 3]},
    "vertices has nan at (4, 2)": lambda s: {"vertices": changed(s.vertices, (4, 2), np.nan)},
    "vertices has inf at (0, 0)": lambda s: {"vertices": changed(s.vertices, (0, 0), np.inf)},
    "normals has nan at (5, 1, 2)": lambda s: {"normals": changed(s.normals, (5, 1, 2), np.nan)},
    "attributes has -inf at (2, 0, 1)": lambda s: {"attributes": changed(s.attributes, (2, 0, 1), -np.inf)},
    "object_attributes has nan at (0, 1, 0)": lambda s: {"object_attributes": changed(s.object_attributes, (0, 1, 0), np.nan)},
    "tables has nan at (0, 255, 3)": lambda s: {"tables": changed(s.tables, (0, 255, 3), np.nan)},
    "texture 'light' has inf at (1, 4, 3)": lambda s: texture(s, (1, 4, 3), np.inf),
    "texture 'light' has nan at (0, 0, 0)": lambda s: texture(s, (0, 0, 0), np.nan),
    "triangle 6 is degenerate": lambda s: {"triangles": changed(s.triangles, (6, 1), s.triangles[6, 0])},
    "camera.kind is 'fisheye'": lambda s: camera(s, kind="fisheye"),
    "film.filter is 'mitchell'": lambda s: {"film": Film("mitchell")},
    "camera.to_world[0] has 2 values, not 4": lambda s: camera(s, to_world=FLAT),
    "camera.window[0] is nan": lambda s: camera(s, window=(NAN, 1.0, -1.0, 1.0)),
    "window=(1.0, 1.0": lambda s: camera(s, window=(1.0, 1.0, -1.0, 1.0)),
    "window=(-1.0, 1.0, 1.0, 0.0)": lambda s: camera(s, window=(-1.0, 1.0, 1.0, 0.0)),
    "near=2.0": lambda s: camera(s, near=2.0, far=1.0),
    "camera.near is -1.0": lambda s: camera(s, near=-1.0),
    "camera.focus is 0.0": lambda s: camera(s, focus=0.0),
    "camera.aperture is -0.1": lambda s: camera(s, aperture=-0.1),
    "camera.aperture_ratio is 0.0": lambda s: camera(s, aperture_ratio=0.0),
    "camera.width is 0": lambda s: camera(s, width=0),
    "camera.height is 99999": lambda s: camera(s, height=99999),
    "film.exposure is nan": lambda s: {"film": replace(s.film, exposure=NAN)},
    "film.filter_width is 0.0": lambda s: {"film": replace(s.film, filter_width=0.0)},
    "bounces.transmission is -1": lambda s: {"bounces": replace(s.bounces, transmission=-1)},
    "lamps[0].kind is 'candle'": lambda s: lamp(s, kind="candle"),
    "lamps[0].emission[1] is inf": lambda s: lamp(s, emission=(1.0, INF, 1.0)),
    "lamps[0].emission[1] is -1.0": lambda s: lamp(s, emission=(1.0, -1.0, 1.0)),
    "lamps[0].radius is nan": lambda s: lamp(s, radius=NAN),
    "lamps[0].radius is -1.0": lambda s: lamp(s, radius=-1.0),
    "lamp 'lamp' has shader 9, but there are": lambda s: lamp(s, shader=9),
    "lamps[0].shader is -2": lambda s: lamp(s, shader=-2),
    "texture 'light' is followed by 1 tiles, but there are 0": lambda s: {"textures": (s.textures[0], replace(s.textures[1], rest=1))},
    "step 0, math, reads": lambda s: shader(s, code=(Instruction("math", (Node(0), 1.0, 0.0), "ADD", (0,)),)),
    "step 1, invert, reads": lambda s: shader(s, code=(Instruction("normal"), Instruction("invert", (1.0, Node(2))))),
    "reads step 1 of 1": lambda s: shader(s, code=(Instruction("normal"),), closures=(Closure("diffuse", 1.0, {"color": Node(1)}),)),
    "shaders[0].closures[0].inputs.color[0] is nan": lambda s: shader(s, closures=(Closure("diffuse", 1.0, {"color": (NAN, 0.0, 0.0)}),)),
    "shaders[0].closures[0].weight is inf": lambda s: shader(s, closures=(Closure("diffuse", INF),)),
    "world.code[0].inputs[0] is nan": lambda s: {"world": Shader("sky", (Instruction("invert", (NAN, 1.0)),))},
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_found_and_named(scene, tmp_path, fault):
    bad = replace(scene, **FAULTS[fault](scene))
    text = find_fault(bad)
    assert fault in text
    assert "\n" not in text
    save(bad, tmp_path / "bad.npz")
    assert text in refusal(tmp_path / "bad.npz")


OLD_NAMES = {
    "kitchen: night": "kitchen_ night", "a?b": "a_b", ".hidden": "hidden", "scene.": "scene", " a": "a", "é" * 100: "é" * 75, "": "_",
    "a/b": "a_b", "..": "_", "../../x": "_.._x", "a\\b": "a_b", "a\x1b[2Jb": "a_[2Jb",
}  # fmt: skip


@pytest.mark.parametrize("name", OLD_NAMES, ids=ascii)
def test_a_bundle_of_an_earlier_version_loads_under_a_name_that_fits(scene, tmp_path, name):
    old = replace(scene, name=name)
    assert f"the name {name!r} " in find_fault(old)  # today's program does not write such a name
    save(old, tmp_path / "old.npz")
    found = load(tmp_path / "old.npz")
    assert (found.name, found.key) == (OLD_NAMES[name], scene.key)


def test_faults_far_into_an_array_are_found(scene):
    """The check reads numbers in blocks, so the fault is in a later block."""
    texels = np.ones((300, 300, 4), np.float32)
    texels[299, 298, 2] = np.nan
    assert "texture 'large' has nan at (299, 298, 2)" in find_fault(replace(scene, textures=(Texture("large", False, texels),)))


def test_triangles_without_area_are_found_where_single_precision_rounds():
    """A triangle on a line through the origin. The differences of its corners do not fit single precision."""
    p, q = np.float32(1 + 2**-23), np.float32(1 + 5 * 2**-23)
    line = np.array([(-p, -q, 0), (2 * p, 2 * q, 0), (0, 0, 0), (0, 0, 1)], np.float32)
    assert without_area(line, np.array([(0, 1, 2), (0, 1, 3)], np.int32)).tolist() == [True, False]


# --- light -------------------------------------------------------------------------------------------------------------

GLOWING = {"emission_strength": 1.0, "emission_color": (1.0, 0.0, 0.0)}
LIGHTS = {
    "none": ((), False),
    "emission": (Closure("emission", 1.0), True),
    "of no weight": (Closure("emission", 0.0), False),
    "of no strength": (Closure("emission", 1.0, {"strength": 0.0}), False),
    "black": (Closure("emission", 1.0, {"color": (0.0, 0.0, 0.0)}), False),
    "computed": (Closure("emission", 1.0, {"strength": Node(0)}), True),
    "reflector": (Closure("diffuse", 1.0), False),
    "principled": (Closure("principled", 1.0), False),
    "glowing principled": (Closure("principled", 1.0, GLOWING), True),
    "dark glow": (Closure("principled", 1.0, GLOWING | {"emission_color": 0.0}), False),
}


@pytest.mark.parametrize("name", LIGHTS)
def test_a_scene_needs_something_that_emits(scene, name):
    closure, lit = LIGHTS[name]
    code, closures = (Instruction("normal"),), (closure,) if closure else ()
    dark = replace(scene, **unlit(scene))
    for values in (shader(dark, code=code, closures=closures), {"world": Shader("", code, closures)}):
        assert ("dark" in find_nothing(replace(dark, **values))) != lit
    assert find_nothing(replace(dark, lamps=scene.lamps)) == ""


def test_an_emitter_that_no_triangle_has_is_no_light(scene):
    dark = replace(scene, **unlit(scene))
    unused = Shader("", (), (Closure("emission", 1.0),))
    assert "dark" in find_nothing(replace(dark, shaders=(*dark.shaders, unused)))


def test_a_scene_without_triangles_is_empty_unless_a_lamp_is_seen():
    nothing = scenes.empty(2, (1.0, 1.0, 1.0))
    assert "empty" in find_nothing(nothing)
    lamps = {
        visibility: (Lamp("", "point", IDENTITY, (1.0, 1.0, 1.0), radius=1.0, visibility=visibility),) for visibility in (VISIBLE, DIFFUSE)
    }
    assert [bool(find_nothing(replace(nothing, lamps=lamps[visibility]))) for visibility in lamps] == [False, True]
    assert find_fault(nothing) == ""


def test_good_scenes_have_no_fault(scene):
    assert find_fault(scene) == find_nothing(scene) == ""
    assert find_fault(scenes.tiny()) == ""
