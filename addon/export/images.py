"""Images as textures: stored codes of 8 bits, or linear floats."""

from dataclasses import replace

import bpy
import numpy as np

from blender_rl_guiding.scene.data import Texture
from blender_rl_guiding.scene.ops import Alpha

from .network import At
from .pictures import frame_shown, pictures
from .resources import Resources
from .simplify import is_above, shrunk

_LINEAR = ("Non-Color", "Linear Rec.709", "Raw")  # colour spaces whose 8-bit codes are linear
_MAGENTA = (1.0, 0.0, 1.0, 1.0)  # of images that cannot be read, as in Cycles


def read_image(at: At, *, wants_alpha: bool) -> tuple[int, Alpha]:
    """The number of the first texture of a node's image, and the relation of its colours to its alpha."""
    image, resources = at.node.image, at.network.resources
    if image is None:
        at.note("no image: magenta stands in, as in Cycles")
        return resources.texture(None, lambda: _missing("")), Alpha.PACKED
    frame = frame_shown(image, at.node.image_user, resources.frame)
    number, alpha, notes = resources.image((image.as_pointer(), frame, wants_alpha), lambda: _read(resources, image, frame, wants_alpha))
    for note in notes:
        at.note(f"image '{image.name}' {note}")
    return number, alpha


def _read(resources: Resources, image: bpy.types.Image, frame: int, wants_alpha: bool) -> tuple[int, Alpha, list[str]]:
    """As `read_image`, and the losses.

    If no node reads the alpha, Cycles multiplies colours by alpha, unless the image's alpha mode keeps the two apart. Colours that Blender
    has already multiplied stay unchanged; they may be positive at alpha 0.
    """
    textures, notes, associated, multiplied = [], _notes(image), False, False
    for tile, rest, place, pixels in pictures(image, frame):
        if pixels is None:
            part = f"has a tile {tile} that " if tile else ""
            notes.append(f"{part}cannot be read ({place or 'no file'}): magenta stands in, as in Cycles")
            textures.append(_missing(image.name, tile, rest))
            continue
        space = pixels.colorspace_settings
        if not pixels.is_float and space.name not in ("sRGB", *_LINEAR):
            notes.append(f"has colour space {space.name}: sRGB stands in")
        associated = image.alpha_mode in ("STRAIGHT", "PREMUL") and not space.is_data
        multiplied = associated and _comes_multiplied(image, pixels.is_float)
        opaque = not wants_alpha and (multiplied or not associated)
        textures.append(Texture(image.name, *_texels(image, pixels, opaque=opaque, multiplied=multiplied), tile, rest))
    opaque = not wants_alpha and (multiplied or not associated)
    multiply = False
    if any(is_above(resources.texture_limit, *t.texels.shape[:2]) for t in textures):
        multiply = associated and not (opaque or multiplied)
        textures = [replace(t, texels=shrunk(t.texels, resources.texture_limit, multiply=multiply)) for t in textures]
    number = resources.tiles((image.as_pointer(), frame, opaque), textures)
    idle = opaque or not associated or all(map(_is_opaque, textures)) or (multiply and not wants_alpha)
    return number, _alpha(wants_alpha, multiplied or multiply, idle), list(dict.fromkeys(notes))


def _alpha(wanted: bool, multiplied: bool, idle: bool) -> Alpha:
    if idle:
        return Alpha.PACKED
    if not wanted:
        return Alpha.PREMULTIPLIED
    return Alpha.MULTIPLIED if multiplied else Alpha.STRAIGHT


def _comes_multiplied(image: bpy.types.Image, is_float: bool) -> bool:
    """Whether Cycles assumes that the colours are multiplied by alpha: for PREMUL images, and for floats that Cycles itself reads.

    Cycles multiplies STRAIGHT floats from Blender a second time, although they are already multiplied.
    """
    return image.alpha_mode == "PREMUL" or (is_float and not _is_handed_over(image))


def _is_handed_over(image: bpy.types.Image) -> bool:
    """Whether Cycles gets the texels from Blender; Cycles reads other files itself."""
    return image.packed_file is not None or image.source in ("GENERATED", "MOVIE")


def _notes(image: bpy.types.Image) -> list[str]:
    return ["has tiles with unsaved changes: the saved files stand in"] if image.source == "TILED" and image.is_dirty else []


def _missing(name: str, tile: int = 0, rest: int = 0) -> Texture:
    return Texture(name, False, np.array([[_MAGENTA]], np.float32), tile, rest)


def _texels(image: bpy.types.Image, pixels: bpy.types.Image, *, opaque: bool, multiplied: bool) -> tuple[bool, np.ndarray]:
    """`srgb` and `texels` of a `Texture`."""
    texels = stored_pixels(pixels)
    if pixels.is_float:
        texels[~np.isfinite(texels).all(axis=2)] = 0.0  # as in Cycles: if one channel is not finite, the whole texel is 0
    if multiplied and not pixels.is_float and not _is_handed_over(image):
        texels[..., :3] *= texels[..., 3:]  # undoes Blender's division; rounded, these are the file's codes
    if opaque or image.alpha_mode == "NONE":
        texels[..., 3] = 1.0
    if pixels.is_float:
        return False, texels
    return pixels.colorspace_settings.name not in _LINEAR, (texels * 255 + 0.5).astype(np.uint8)


def stored_pixels(image: bpy.types.Image) -> np.ndarray:
    """(H, W, 4) float32, top row first: codes / 255 of 8-bit images, linear colours of others."""
    width, height, channels = *image.size, image.channels
    stored = np.empty(width * height * channels, np.float32)
    image.pixels.foreach_get(stored)
    stored = stored.reshape(height, width, channels)[::-1]
    if channels == 4:
        return np.ascontiguousarray(stored)
    texels = np.ones((height, width, 4), np.float32)
    texels[..., :3] = stored[..., :3] if channels == 3 else stored[..., :1]
    return texels


def _is_opaque(texture: Texture) -> bool:
    return bool((texture.texels[..., 3] == (255 if texture.texels.dtype == np.uint8 else 1)).all())
