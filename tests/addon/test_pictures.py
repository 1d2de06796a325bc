"""Images of several files: the frame of a sequence or movie, the tiles of a tiled image."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from PIL import Image

from addon.export.materials import read_material
from addon.export.resources import Resources
from tests.addon.trees import color_of, node

COLORS = [(255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 0)]


def write(path: Path, color: tuple[int, ...], size: int = 1) -> Path:
    Image.new("RGB", (size, size), color).save(path)
    return path


def exported(material: bpy.types.Material, image: bpy.types.Image, frame: int = 1, kind: str = "ShaderNodeTexImage", **user: object):
    """(resources, notes) of a material with an image, at a frame of the scene."""
    texture = node(material.node_tree, kind, into=color_of(material.node_tree))
    texture.image = image
    for name, value in user.items():
        setattr(texture.image_user, name, value)
    resources = Resources(frame)
    _, notes = read_material(material, resources)
    return resources, [detail for _, detail in notes]


@pytest.fixture
def sequence(tmp_path: Path) -> bpy.types.Image:
    for number, color in enumerate(COLORS, 1):
        write(tmp_path / f"shot2_{number:03d}.png", color)
    image = bpy.data.images.load(str(tmp_path / "shot2_001.png"))
    image.source = "SEQUENCE"
    return image


@pytest.mark.parametrize("kind", ["ShaderNodeTexImage", "ShaderNodeTexEnvironment"])
@pytest.mark.parametrize(
    ("frame", "user", "shown"),
    [  # measured in Cycles 5.2
        (7, {"frame_duration": 4, "frame_start": 5}, 3),
        (5, {"frame_duration": 4, "frame_start": 5, "use_auto_refresh": False}, 1),
        (20, {"frame_duration": 4, "frame_start": 5}, 4),
        (10, {"frame_duration": 4, "frame_start": 5, "use_cyclic": True}, 2),
        (2, {"frame_duration": 4, "frame_start": 5, "use_cyclic": True}, 2),
        (3, {"frame_duration": 4, "frame_offset": 1}, 4),
    ],
)
def test_a_sequence_shows_the_file_of_the_frame(
    paint: bpy.types.Material, sequence: bpy.types.Image, kind: str, frame: int, user: dict, shown: int
):
    resources, notes = exported(paint, sequence, frame, kind, **user)
    assert notes == []
    assert tuple(resources.textures[0].texels[0, 0, :3]) == COLORS[shown - 1]


@pytest.mark.parametrize(
    ("frame", "user", "missing"), [(1, {"frame_start": 5}, 0), (9, {"frame_duration": 9}, 9), (3, {"frame_duration": 0}, 0)]
)
def test_files_of_a_sequence_that_are_not_there(
    paint: bpy.types.Material, sequence: bpy.types.Image, tmp_path: Path, frame: int, user: dict, missing: int
):
    resources, notes = exported(paint, sequence, frame, **user)
    place = tmp_path / f"shot2_{missing:03d}.png"
    assert notes == [f"image 'shot2_001.png' cannot be read ({place}): magenta stands in, as in Cycles"]
    assert resources.textures[0].texels.ravel().tolist() == [1, 0, 1, 1]


@pytest.mark.parametrize("source", ["SEQUENCE", "MOVIE"])
def test_animated_images_without_a_file(paint: bpy.types.Material, source: str):
    image = bpy.data.images.new("Lost", 1, 1)
    image.source, image.filepath = source, ""
    assert exported(paint, image)[1] == ["image 'Lost' cannot be read (no file): magenta stands in, as in Cycles"]


def test_one_sequence_in_two_frames_makes_two_textures(paint: bpy.types.Material, sequence: bpy.types.Image):
    mix = node(paint.node_tree, "ShaderNodeMixRGB", into=color_of(paint.node_tree))
    for name, offset in (("Color1", 0), ("Color2", 2)):
        texture = node(paint.node_tree, "ShaderNodeTexImage", into=mix.inputs[name])
        texture.image, texture.image_user.frame_offset = sequence, offset
    resources = Resources(2)
    read_material(paint, resources)
    assert [tuple(texture.texels[0, 0, :3]) for texture in resources.textures] == [COLORS[1], COLORS[3]]


def test_a_movie_shows_its_frame(paint: bpy.types.Material, tmp_path: Path):
    movie = Image.new("RGB", (16, 16), COLORS[0])
    movie.save(tmp_path / "movie.gif", save_all=True, append_images=[Image.new("RGB", (16, 16), color) for color in COLORS[1:]])
    image = bpy.data.images.load(str(tmp_path / "movie.gif"))
    image.source = "MOVIE"
    resources, notes = exported(paint, image, 3, frame_duration=4)
    assert notes == []
    assert np.abs(resources.textures[0].texels[8, 8, :3].astype(int) - COLORS[2]).max() < 8


@pytest.fixture
def tiled(tmp_path: Path) -> bpy.types.Image:
    """A tiled image: 1001 and the larger 1012 exist, 1002 does not."""
    image = bpy.data.images.load(str(write(tmp_path / "t.1001.png", COLORS[0])))
    write(tmp_path / "t.1012.png", COLORS[2], 2)
    image.source, image.filepath = "TILED", str(tmp_path / "t.<UDIM>.png")
    for number in {1002, 1012} - {tile.number for tile in image.tiles}:
        image.tiles.new(number)
    return image


def described(resources: Resources) -> list[tuple]:
    return [(t.tile, t.rest, t.texels.shape[0], tuple(t.texels[0, 0, :3])) for t in resources.textures]


def test_tiles_follow_each_other(paint: bpy.types.Material, tiled: bpy.types.Image, tmp_path: Path):
    resources, notes = exported(paint, tiled)
    assert described(resources) == [(1001, 2, 1, COLORS[0]), (1002, 1, 1, (1, 0, 1)), (1012, 0, 2, COLORS[2])]
    assert notes == [f"image 't.1001.png' has a tile 1002 that cannot be read ({tmp_path / 't.1002.png'}): magenta stands in, as in Cycles"]


def test_packed_tiles(paint: bpy.types.Material, tiled: bpy.types.Image, tmp_path: Path):
    tiled.tiles.remove(next(tile for tile in tiled.tiles if tile.number == 1002))
    tiled.pack()
    for file in tmp_path.iterdir():
        file.unlink()
    resources, notes = exported(paint, tiled)
    assert (described(resources), notes) == ([(1001, 1, 1, COLORS[0]), (1012, 0, 2, COLORS[2])], [])


def test_names_of_tiles_by_column_and_row(paint: bpy.types.Material, tiled: bpy.types.Image, tmp_path: Path):
    for name, color in (("u1_v1", COLORS[3]), ("u2_v1", COLORS[2]), ("u2_v2", COLORS[1])):
        write(tmp_path / f"{name}.png", color)
    tiled.filepath = str(tmp_path / "<UVTILE>.png")
    resources, notes = exported(paint, tiled)
    assert (described(resources), notes) == ([(1001, 2, 1, COLORS[3]), (1002, 1, 1, COLORS[2]), (1012, 0, 1, COLORS[1])], [])


def test_tiles_that_are_not_saved_anywhere(paint: bpy.types.Material):
    _, notes = exported(paint, bpy.data.images.new("Bare", 2, 2, tiled=True))
    assert notes == ["image 'Bare' has a tile 1001 that cannot be read (no file): magenta stands in, as in Cycles"]


def test_surroundings_have_no_tiles(paint: bpy.types.Material, tiled: bpy.types.Image):
    _, notes = exported(paint, tiled, kind="ShaderNodeTexEnvironment")
    assert notes == ["image 't.1001.png' has tiles, but surroundings have not: magenta stands in, as in Cycles"]
