"""EXR files keep every bit, and Blender reads them. A damaged file is refused in one line."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.images import read_exr, to_display, write_exr, write_layers, write_png
from tests.patience import PATIENCE


@pytest.fixture
def image() -> np.ndarray:
    pixels = np.random.default_rng(1).gamma(0.5, size=(5, 7, 3)).astype(np.float32)
    pixels[0, 0] = 1e6, 0.0, 1e-6  # half floats cannot hold these
    return pixels


def test_round_trip_keeps_every_bit_and_the_header(tmp_path: Path, image: np.ndarray):
    header = {"settings": json.dumps({"samples": 32}), "scene_key": "ab" * 32, "name_with_ä": "ü"}
    write_exr(tmp_path / "new" / "image.exr", image, header)
    pixels, read = read_exr(tmp_path / "new" / "image.exr")
    assert pixels.dtype == np.float32
    assert np.array_equal(pixels, image)
    assert header.items() <= read.items()
    assert [p.name for p in (tmp_path / "new").iterdir()] == ["image.exr"]


def test_a_view_that_is_not_contiguous_is_written_right(tmp_path: Path, image: np.ndarray):
    write_exr(tmp_path / "flipped.exr", image[::-1, ::2], {})
    assert np.array_equal(read_exr(tmp_path / "flipped.exr")[0], image[::-1, ::2])


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize("alpha", [False, True])
def test_reads_half_floats_and_alpha(tmp_path: Path, image: np.ndarray, dtype: type, alpha: bool):
    channels = {c: np.ascontiguousarray(image[1:, :, k].astype(dtype)) for k, c in enumerate("RGB")}
    if alpha:
        channels["A"] = np.ones_like(channels["R"])
    OpenEXR.File({}, channels).write(str(tmp_path / "a.exr"))
    assert np.array_equal(read_exr(tmp_path / "a.exr")[0], image[1:].astype(dtype))


@pytest.mark.parametrize("prefix", ["", "ViewLayer.Combined."])
def test_reads_the_right_part_of_several(tmp_path: Path, image: np.ndarray, prefix: str):
    depth = OpenEXR.Part({}, {"ViewLayer.Depth.V": image[..., 0].copy()}, "depth")
    colour = OpenEXR.Part({}, {f"ViewLayer.Colour.{c}": np.zeros((5, 7), np.float32) for c in "RGB"}, "colour")
    beauty = OpenEXR.Part({}, {prefix + c: image[..., k].copy() for k, c in enumerate("RGB")}, "beauty")
    OpenEXR.File([depth, colour, beauty]).write(str(tmp_path / "parts.exr"))
    assert np.array_equal(read_exr(tmp_path / "parts.exr")[0], image)


def test_bad_files_are_refused_in_one_line(tmp_path: Path, image: np.ndarray, capfd: pytest.CaptureFixture[str]):
    good = tmp_path / "good.exr"
    write_exr(good, np.tile(image, (20, 20, 1)), {})
    data = good.read_bytes()
    bad = {"empty": b"", "text": b"not an image", "head": data[:200], "half": data[: len(data) // 2], "tail": data[:-50]}
    for name, content in bad.items():
        (tmp_path / name).write_bytes(content)
    OpenEXR.File({}, {"Z": image[..., 0].copy()}).write(str(tmp_path / "depth"))
    for name in [*bad, "depth", "missing", "."]:
        with pytest.raises(InputError) as error:
            read_exr(tmp_path / name)
        assert str(tmp_path / name) in str(error.value)
        assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


def test_an_unwritable_place_is_named(tmp_path: Path, image: np.ndarray):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"cannot write .*image\.exr"):
        write_exr(tmp_path / "file" / "image.exr", image, {})
    (tmp_path / "folder.exr").mkdir()
    with pytest.raises(InputError, match=r"cannot write .*folder\.exr"):
        write_exr(tmp_path / "folder.exr", image, {})
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder.exr"]


def test_display_is_srgb():
    codes = to_display(np.array([-1.0, 0.0, 0.0031308, 0.2158605, 0.5, 1.0, 9.0]))
    assert codes.dtype == np.uint8
    assert codes.tolist() == [0, 0, 10, 128, 188, 255, 255]


def test_png_has_the_codes(tmp_path: Path, image: np.ndarray):
    from PIL import Image

    write_png(tmp_path / "image.png", image)
    with Image.open(tmp_path / "image.png") as file:
        assert np.array_equal(np.asarray(file), to_display(image))


def test_png_has_colours_without_alpha_and_coverage_without_gamma(tmp_path: Path):
    from PIL import Image

    write_png(tmp_path / "image.png", np.array([[(0.1, 0.2, 0.25, 0.5), (0, 0, 0, 0), (9, 1, 0, 1.0001)]], np.float32))
    with Image.open(tmp_path / "image.png") as file:
        codes = np.asarray(file)
    np.testing.assert_array_equal(codes[0, 0], [*to_display(np.array((0.2, 0.4, 0.5))), 128])
    np.testing.assert_array_equal(codes[0, 1:], [(0, 0, 0, 0), (255, 255, 0, 255)])


READ_IN_BLENDER = """
import sys, bpy, numpy as np
image = bpy.data.images.load(sys.argv[1])
pixels = np.empty(len(image.pixels), np.float32)
image.pixels.foreach_get(pixels)
np.save(sys.argv[2], pixels.reshape(*image.size[::-1], image.channels)[::-1])
"""

WRITE_IN_BLENDER = """
import sys, bpy
scene = bpy.context.scene
scene.render.engine, scene.cycles.samples = "CYCLES", 1
scene.render.resolution_x, scene.render.resolution_y = 8, 4
scene.view_layers[0].use_pass_diffuse_color = scene.view_layers[0].use_pass_normal = True
for kind, path in (("IMAGE", sys.argv[1]), ("MULTI_LAYER_IMAGE", sys.argv[2])):
    scene.render.image_settings.media_type = kind
    if kind == "IMAGE":
        scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
"""


def run(script: str, *arguments: Path | str) -> None:
    subprocess.run([sys.executable, "-c", script, *map(str, arguments)], check=True, capture_output=True, timeout=PATIENCE)


@pytest.mark.blender
def test_blender_reads_the_same_numbers(tmp_path: Path, image: np.ndarray):
    write_exr(tmp_path / "image.exr", image, {"settings": "{}"})
    run(READ_IN_BLENDER, tmp_path / "image.exr", tmp_path / "read.npy")
    assert np.array_equal(np.load(tmp_path / "read.npy")[..., :3], image)


@pytest.mark.blender
def test_reads_what_blender_writes(tmp_path: Path):
    run(WRITE_IN_BLENDER, tmp_path / "single.exr", tmp_path / "layers.exr")
    single, header = read_exr(tmp_path / "single.exr")
    assert single.shape == (4, 8, 3)
    assert header["Software"].startswith("Blender")
    assert single.max() > 0.0
    assert np.array_equal(read_exr(tmp_path / "layers.exr")[0], single)


# --- passes ------------------------------------------------------------------------------------------------------------

NAMES = {"Combined": "RGBA", "Albedo": "RGB", "Normal": "XYZ", "Depth": "Z", "Position": "XYZ", "Variance": "RGB", "Sample Count": "X"}


@pytest.fixture
def layers() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(2)
    return {name: rng.random((5, 7, len(cs)) if len(cs) > 1 else (5, 7), np.float32) for name, cs in NAMES.items()}


def test_layers_keep_every_bit_under_blenders_names(tmp_path: Path, layers: dict[str, np.ndarray]):
    write_layers(tmp_path / "passes.exr", layers, {"settings": "{}"})
    with OpenEXR.File(str(tmp_path / "passes.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
        assert file.header()["settings"] == "{}"
    expected = {f"ViewLayer.{name}.{c}": np.atleast_3d(layers[name])[..., k] for name, cs in NAMES.items() for k, c in enumerate(cs)}
    assert channels.keys() == expected.keys()
    for name, pixels in expected.items():
        assert np.array_equal(channels[name], pixels), name
    assert np.array_equal(read_exr(tmp_path / "passes.exr")[0], layers["Combined"][..., :3])


LAYERS_IN_BLENDER = """
import json, sys, bpy
scene, tree = bpy.context.scene, bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
node, output = tree.nodes.new("CompositorNodeImage"), tree.nodes.new("NodeGroupOutput")
node.image = bpy.data.images.load(sys.argv[1])
tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
tree.links.new(node.outputs[sys.argv[2]], output.inputs[0])
scene.compositing_node_group = tree
scene.render.engine, scene.cycles.samples = "CYCLES", 1
scene.render.resolution_x, scene.render.resolution_y = 7, 5
scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
scene.render.filepath = sys.argv[3]
bpy.ops.render.render(write_still=True)
with open(sys.argv[4], "w") as file:
    json.dump([node.image.type, {socket.name: socket.type for socket in node.outputs if socket.enabled}], file)
"""


@pytest.mark.blender
def test_blender_composites_layers_as_passes(tmp_path: Path, layers: dict[str, np.ndarray]):
    write_layers(tmp_path / "passes.exr", layers, {})
    run(LAYERS_IN_BLENDER, tmp_path / "passes.exr", "Position", tmp_path / "seen.exr", tmp_path / "seen.json")
    kind, sockets = json.loads((tmp_path / "seen.json").read_text())
    assert kind == "MULTILAYER"
    assert sockets.items() >= {name: {"X": "VALUE", "Z": "VALUE", "XYZ": "VECTOR"}.get(cs, "RGBA") for name, cs in NAMES.items()}.items()
    assert np.array_equal(read_exr(tmp_path / "seen.exr")[0], layers["Position"])
