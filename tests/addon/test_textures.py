"""Image and texture nodes: stored texels, top row first, with Cycles' alpha; patterns with their modes."""

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenEXR
import pytest
from PIL import Image

from addon.export.resources import Resources
from blender_rl_guiding.scene.data import Texture
from blender_rl_guiding.scene.ops import Alpha
from tests.addon.trees import color, color_of, node, read, surface

PREMULTIPLIED, STRAIGHT, PACKED, MULTIPLIED = Alpha
CODES = np.array([[[255, 0, 0, 255], [0, 255, 0, 255]], [[0, 0, 255, 255], [10, 100, 200, 255]]], np.uint8)  # top row first
FAINT = np.array([[[128, 64, 255, 128]]], np.uint8)


@pytest.fixture
def tree(paint: bpy.types.Material) -> bpy.types.NodeTree:
    return paint.node_tree


def png(folder: Path, codes: np.ndarray, name: str = "image.png") -> bpy.types.Image:
    Image.fromarray(codes).save(folder / name)
    return bpy.data.images.load(str(folder / name))


def exr(folder: Path, pixels: np.ndarray) -> bpy.types.Image:
    path = str(folder / "image.exr")
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGBA" if pixels.shape[2] == 4 else "RGB": pixels.astype(np.float32)}).write(path)
    return bpy.data.images.load(path)


def shown(tree: bpy.types.NodeTree, image: bpy.types.Image | None, *, alpha: bool = False) -> bpy.types.Node:
    """Link an Image Texture to the colour, and its alpha to the strength."""
    texture = node(tree, "ShaderNodeTexImage", into=color_of(tree))
    texture.image = image
    if alpha:
        tree.links.new(texture.outputs["Alpha"], surface(tree).links[0].from_node.inputs["Strength"])
    return texture


def only_texture(material: bpy.types.Material) -> tuple[Texture, Any]:
    """(texture, treatment of its alpha)."""
    resources = Resources()
    op, (number, _, _, alpha), _ = color(material, resources)
    assert op == "image"
    return resources.textures[number], alpha


# --- images ----------------------------------------------------------------------------------------------------------


def test_codes_arrive_untouched(paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path):
    shown(tree, png(tmp_path, CODES))
    texture, alpha = only_texture(paint)
    assert (texture.name, texture.srgb, alpha) == ("image.png", True, PACKED)
    assert texture.texels.dtype == np.uint8
    assert (texture.texels == CODES).all()


@pytest.mark.parametrize("channels", [1, 3])
def test_images_without_all_channels(paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path, channels: int):
    shown(tree, png(tmp_path, CODES[..., 2] if channels == 1 else CODES[..., :3]))
    texels = only_texture(paint)[0].texels
    assert (texels[..., :3] == (CODES[..., 2:3] if channels == 1 else CODES[..., :3])).all()
    assert (texels[..., 3] == 255).all()


def test_packed_images(paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path):
    image = png(tmp_path, CODES)
    image.pack()
    (tmp_path / "image.png").unlink()
    shown(tree, image)
    assert (only_texture(paint)[0].texels == CODES).all()


def test_generated_images(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    image = bpy.data.images.new("Made", 2, 1)
    image.pixels = [1, 0, 0, 1, 0, 0, 1, 1]
    shown(tree, image)
    assert only_texture(paint)[0].texels.tolist() == [[[255, 0, 0, 255], [0, 0, 255, 255]]]


def test_floats_are_linear_and_may_exceed_one(paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path):
    pixels = np.array([[[0.5, 2.0, 100.0]], [[0.0, 0.25, 1.0]]])
    shown(tree, exr(tmp_path, pixels))
    texture, alpha = only_texture(paint)
    assert (texture.texels.dtype, alpha) == (np.float32, PACKED)
    assert (texture.texels[..., :3] == pixels).all()


def test_texels_that_are_not_finite_are_black_and_clear(paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path):
    pixels = np.ones((2, 3, 4), np.float32)
    pixels[0, 1, 2], pixels[1, 0, 0], pixels[1, 2, 3] = np.nan, np.inf, -np.inf
    shown(tree, exr(tmp_path, pixels), alpha=True)
    expected = np.where(np.isfinite(pixels).all(axis=2, keepdims=True), 1.0, 0.0)
    assert (only_texture(paint)[0].texels == expected).all()


@pytest.mark.parametrize(("space", "srgb"), [("sRGB", True), ("Non-Color", False), ("Linear Rec.709", False)])
def test_colour_spaces(paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path, space: str, srgb: bool):
    shown(tree, png(tmp_path, CODES)).image.colorspace_settings.name = space
    texture, _ = only_texture(paint)
    assert texture.srgb == srgb
    assert (texture.texels == CODES).all()


@pytest.mark.parametrize(
    ("mode", "space", "wanted", "expected"),
    [  # measured in Cycles 5.2
        ("STRAIGHT", "sRGB", False, PREMULTIPLIED),
        ("STRAIGHT", "sRGB", True, STRAIGHT),
        ("STRAIGHT", "Non-Color", False, PACKED),
        ("CHANNEL_PACKED", "sRGB", False, PACKED),
        ("NONE", "sRGB", False, PACKED),
        ("NONE", "sRGB", True, PACKED),
    ],
)
def test_alpha_of_codes(
    paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path, mode: str, space: str, wanted: bool, expected: Alpha
):
    image = png(tmp_path, FAINT)
    image.alpha_mode, image.colorspace_settings.name = mode, space
    shown(tree, image, alpha=wanted)
    texture, alpha = only_texture(paint)
    assert alpha == expected
    assert (texture.texels[..., :3] == FAINT[..., :3]).all()
    assert texture.texels[0, 0, 3] == (255 if mode == "NONE" or (expected == PACKED and not wanted) else 128)


@pytest.mark.parametrize(
    ("mode", "packed", "wanted", "expected"),
    [  # measured in Cycles 5.2
        ("PREMUL", False, False, PACKED),
        ("PREMUL", False, True, MULTIPLIED),
        ("PREMUL", True, False, PACKED),
        ("PREMUL", True, True, MULTIPLIED),
        ("STRAIGHT", False, False, PACKED),
        ("STRAIGHT", False, True, MULTIPLIED),
        ("STRAIGHT", True, False, PREMULTIPLIED),
        ("STRAIGHT", True, True, STRAIGHT),
        ("CHANNEL_PACKED", False, True, PACKED),
    ],
)
def test_alpha_of_floats(
    paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path, mode: str, packed: bool, wanted: bool, expected: Alpha
):
    image = exr(tmp_path, np.array([[[0.25, 0.125, 0.5, 0.5]]]))
    if packed:
        image.pack()
    image.alpha_mode = mode
    stored = list(image.pixels)
    shown(tree, image, alpha=wanted)
    texture, alpha = only_texture(paint)
    assert alpha == expected
    assert texture.texels.ravel().tolist() == [*stored[:3], 1.0 if expected == PACKED and not wanted else stored[3]]


@pytest.mark.parametrize(("wanted", "expected"), [(False, PACKED), (True, MULTIPLIED)])
def test_codes_that_come_multiplied(paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path, wanted: bool, expected: Alpha):
    image = png(tmp_path, np.array([[[100, 60, 20, 128], [1, 2, 3, 7]]], np.uint8))
    image.alpha_mode = "PREMUL"
    shown(tree, image, alpha=wanted)
    texture, alpha = only_texture(paint)
    assert alpha == expected
    assert texture.texels[0, :, :3].tolist() == [[100, 60, 20], [1, 2, 3]]


@pytest.mark.parametrize(("extension", "expected"), [("REPEAT", STRAIGHT), ("CLIP", PREMULTIPLIED)])
def test_nodes_that_do_the_same_are_one(
    paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path, extension: str, expected: Alpha
):
    image = png(tmp_path, FAINT)
    shown(tree, image)
    other = node(tree, "ShaderNodeTexImage", into=surface(tree).links[0].from_node.inputs["Strength"], output="Alpha")
    other.image, other.extension = image, extension
    assert only_texture(paint)[1] == expected


def test_light_without_alpha_is_kept(paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path):
    shown(tree, exr(tmp_path, np.array([[[4.0, 2.0, 1.0, 0.0]]])))
    assert only_texture(paint)[0].texels.ravel().tolist() == [4, 2, 1, 1]


def test_an_image_is_kept_once(paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path):
    image = png(tmp_path, CODES)
    mix = node(tree, "ShaderNodeMixRGB", into=color_of(tree))
    for name, extension in (("Color1", "CLIP"), ("Color2", "MIRROR")):
        texture = node(tree, "ShaderNodeTexImage", into=mix.inputs[name])
        texture.image, texture.extension, texture.interpolation = image, extension, "Closest"
    resources = Resources()
    uv = ("attribute", (0,))
    assert color(paint, resources)[3][1:] == (("image", (0, 2, 1, PACKED), (uv,)), ("image", (0, 3, 1, PACKED), (uv,)))
    assert len(resources.textures) == 1


@pytest.mark.parametrize("path", ["", "/nowhere/image.png"])
def test_images_that_cannot_be_read_are_magenta(paint: bpy.types.Material, tree: bpy.types.NodeTree, path: str):
    image = bpy.data.images.new("Lost", 1, 1)
    image.source, image.filepath = "FILE", path
    shown(tree, image)
    resources = Resources()
    assert read(paint, resources)[1] == [
        f"node 'Image Texture': image 'Lost' cannot be read ({path or 'no file'}): magenta stands in, as in Cycles"
    ]
    assert resources.textures[0].texels.ravel().tolist() == [1, 0, 1, 1]


def test_no_image_is_magenta(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    shown(tree, None)
    resources = Resources()
    assert read(paint, resources)[1] == ["node 'Image Texture': no image: magenta stands in, as in Cycles"]
    assert resources.textures[0].texels.ravel().tolist() == [1, 0, 1, 1]


@pytest.mark.parametrize(
    ("change", "detail"),
    [
        ({"projection": "BOX"}, "projection BOX: FLAT stands in"),
        ({"interpolation": "Cubic"}, "interpolation Cubic: Linear stands in"),
        ({"image.colorspace_settings.name": "ACEScg"}, "image 'image.png' has colour space ACEScg: sRGB stands in"),
        ({"texture_mapping.scale": (2, 1, 1)}, "texture mapping: the coordinates are not mapped"),
    ],
)
def test_what_is_lost_of_images(paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path, change: dict, detail: str):
    texture = shown(tree, png(tmp_path, CODES))
    assert read(paint)[1] == []
    for path, value in change.items():
        *owners, name = path.split(".")
        setattr(texture.path_resolve(".".join(owners)) if owners else texture, name, value)
    assert read(paint)[1] == [f"node 'Image Texture': {detail}"]


def test_environments(paint: bpy.types.Material, tree: bpy.types.NodeTree, tmp_path: Path):
    texture = node(tree, "ShaderNodeTexEnvironment", into=color_of(tree))
    texture.image, texture.projection = png(tmp_path, CODES), "MIRROR_BALL"
    assert color(paint) == ("environment", (0, 1, 0), (("position",),))


# --- patterns --------------------------------------------------------------------------------------------------------


def scaled(by: float) -> tuple:
    return ("vector_math", "SCALE", (("attribute", (0,)), 0.0, 0.0, by))


@pytest.mark.parametrize(
    ("kind", "properties", "output", "expected"),
    [
        ("ShaderNodeTexChecker", {}, 0, ("checker", "COLOR", (scaled(5.0), (0.5, 0.5, 0.5), (0.25, 0.25, 0.25)))),
        ("ShaderNodeTexChecker", {}, 1, ("checker", "FACTOR", (scaled(5.0), (0.5, 0.5, 0.5), (0.25, 0.25, 0.25)))),
        ("ShaderNodeTexGradient", {"gradient_type": "RADIAL"}, 1, ("gradient", "RADIAL", (("attribute", (0,)),))),
        ("ShaderNodeTexNoise", {}, "Color", ("noise", "COLOR", (3, 1), (scaled(5.0), 2.0, 0.5, 2.0, 0.0))),
        (
            "ShaderNodeTexNoise",
            {"noise_dimensions": "1D", "normalize": False},
            0,
            ("noise", "FACTOR", (1, 0), (("vector_math", "SCALE", (0.0, 0.0, 0.0, 5.0)), 2.0, 0.5, 2.0, 0.0)),
        ),
        ("ShaderNodeTexWhiteNoise", {}, "Color", ("white_noise", "COLOR", (3,), ((0.0, 0.0, 0.0),))),
        ("ShaderNodeTexWhiteNoise", {"noise_dimensions": "1D"}, 0, ("white_noise", "FACTOR", (1,), (0.0,))),
    ],
)
def test_patterns(paint: bpy.types.Material, tree: bpy.types.NodeTree, kind: str, properties: dict, output: int | str, expected: tuple):
    texture = node(tree, kind, into=color_of(tree), output=output)
    for name, value in properties.items():
        setattr(texture, name, value)
    for name, value in (("Color1", 0.5), ("Color2", 0.25)):
        if name in texture.inputs:
            texture.inputs[name].default_value = (value, value, value, 1)
    assert color(paint) == expected


@pytest.mark.parametrize(
    ("kind", "change", "detail"),
    [
        ("ShaderNodeTexNoise", {"noise_type": "RIDGED_MULTIFRACTAL"}, "noise of RIDGED_MULTIFRACTAL"),
        ("ShaderNodeTexNoise", {"noise_dimensions": "4D"}, "noise of 4 dimensions"),
        ("ShaderNodeTexWhiteNoise", {"noise_dimensions": "4D"}, "noise of 4 dimensions"),
    ],
)
def test_other_noise(paint: bpy.types.Material, tree: bpy.types.NodeTree, kind: str, change: dict, detail: str):
    texture = node(tree, kind, into=color_of(tree))
    for name, value in change.items():
        setattr(texture, name, value)
    stand_in = "is not supported: the unlinked values of the sockets that it leads to stand in"
    assert read(paint)[1] == [f"node '{texture.name}': {detail} {stand_in}"]
