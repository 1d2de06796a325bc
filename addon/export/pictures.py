"""The pictures of an image: one frame of a sequence or movie, or the tiles of a tiled image."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import bpy

_LAST_NUMBER = re.compile(r"(.*?)(\d+)(\D*)", re.DOTALL)


class Picture(NamedTuple):
    """A picture of an image."""

    tile: int  # its UDIM number; 0 if the image has no tiles
    rest: int  # how many tiles follow
    place: str  # path of its file
    pixels: bpy.types.Image | None  # valid only until the next picture is requested; None if the pixels cannot be read


def pictures(image: bpy.types.Image, frame: int) -> Iterator[Picture]:
    """All pictures of an image: tiles in rising order, or the picture of a frame, see `frame_shown`.

    Blender gives access to the pixels of only one frame and tile. Other frames and tiles are read as separate images, outside of the user's
    file.
    """
    if image.source == "SEQUENCE":
        found = [(0, _sequence_path(image, frame))]
    elif image.source == "MOVIE":
        found = [(0, _absolute(image))]
    elif image.source == "TILED":
        found = [(tile.number, _tile_path(image, tile.number)) for tile in sorted(image.tiles, key=lambda tile: tile.number)]
    else:
        yield Picture(0, 0, image.filepath, image if image.size[0] else None)
        return
    packed = {file.tile_number: file.packed_file for file in image.packed_files}
    with bpy.data.temp_data() as data:  # Blender crashes if references to this exist when the next one is made
        for k, (tile, path) in enumerate(found, 1):
            pixels = _unpacked(data, packed[tile].data) if packed.get(tile) else _opened(data, path)
            if pixels:
                _set_up(data, pixels, image, frame)
            yield Picture(tile, len(found) - k, path, pixels if pixels and pixels.size[0] else None)
            if pixels:
                data.images.remove(pixels)


def frame_shown(image: bpy.types.Image, user: bpy.types.ImageUser, frame: int) -> int:
    """The number of an animated image's picture at a frame of the scene; 0 for other images.

    As in Cycles, Auto Refresh has no effect.
    """
    if image.source not in ("SEQUENCE", "MOVIE"):
        return 0
    length, place = user.frame_duration, frame - user.frame_start + 1
    if not length:
        return 0
    place = ((place - 1) % length + 1) if user.use_cyclic else min(max(place, 0), length)
    return place + user.frame_offset


def _sequence_path(image: bpy.types.Image, frame: int) -> str:
    """The path with the frame in place of the last number of its name."""
    if not image.filepath:
        return ""
    path = Path(_absolute(image))
    found = _LAST_NUMBER.fullmatch(path.stem)
    head, digits, tail = found.groups() if found else (path.stem, "", "")
    return str(path.with_name(f"{head}{max(frame, 0):0{len(digits)}d}{tail}{path.suffix}"))


def _tile_path(image: bpy.types.Image, tile: int) -> str:
    column, row = (tile - 1001) % 10, (tile - 1001) // 10
    return _absolute(image).replace("<UDIM>", f"{tile:04d}").replace("<UVTILE>", f"u{column + 1}_v{row + 1}")


def _absolute(image: bpy.types.Image) -> str:
    return bpy.path.abspath(image.filepath, library=image.library) if image.filepath else ""


def _opened(data: bpy.types.BlendData, path: str) -> bpy.types.Image | None:
    try:
        return data.images.load(path)
    except RuntimeError:  # there is no such file
        return None


def _unpacked(data: bpy.types.BlendData, content: bytes) -> bpy.types.Image:
    pixels = data.images.new("Packed", 1, 1)
    pixels.pack(data=content, data_len=len(content))
    pixels.source = "FILE"
    return pixels


def _set_up(data: bpy.types.BlendData, pixels: bpy.types.Image, image: bpy.types.Image, frame: int) -> None:
    """Give a picture the settings of its image."""
    pixels.alpha_mode = image.alpha_mode
    image.size[:]  # this access makes Blender choose a colour space
    if image.colorspace_settings.name:
        pixels.colorspace_settings.name = image.colorspace_settings.name
    if image.source == "MOVIE":  # its pixels belong to the frame of the last access
        texture = data.textures.new("Seek", "IMAGE")
        texture.image = pixels
        texture.image_user.frame_duration = max(frame, 1)
        texture.image_user.frame_current = frame
        texture.evaluate((0.0, 0.0, 0.0))
