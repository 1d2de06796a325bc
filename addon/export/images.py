"""Images as textures: stored codes of 8 bits, or linear floats."""

from dataclasses import replace

import bpy
import numpy as np

from blender_rl_guiding.scene.data import Texture
from blender_rl_guiding.scene.ops import Alpha

from .network import At
from .simplify import is_above, shrunk

_LINEAR = ("Non-Color", "Linear Rec.709", "Raw")  # names of colour spaces whose 8-bit codes mean what they say
_MAGENTA = (1.0, 0.0, 1.0, 1.0)  # of images that cannot be read, as in Cycles


def read_image(at: At, *, wants_alpha: bool) -> tuple[int, Alpha]:
    """The number of the texture of a node's image, and what its colours have to do with its alpha.

    Where nobody wants the alpha, Cycles shows colours multiplied by it, unless the image says that the two have nothing to do with
    each other. Those that come multiplied already are taken as they are, since there is light where alpha is 0.
    """
    image, resources = at.node.image, at.network.resources
    _check(at, image)
    if image is None or not image.size[0]:
        return resources.texture(None, lambda: Texture("", False, np.array([[_MAGENTA]], np.float32))), Alpha.PACKED
    associated = image.alpha_mode in ("STRAIGHT", "PREMUL") and not image.colorspace_settings.is_data
    multiplied = associated and _comes_multiplied(image)
    opaque = not wants_alpha and (multiplied or not associated)
    shrinks = is_above(resources.texture_limit, *image.size)
    multiply = shrinks and associated and not (opaque or multiplied)

    def read() -> Texture:
        texture = _texture(image, opaque=opaque, multiplied=multiplied)
        return replace(texture, texels=shrunk(texture.texels, resources.texture_limit, multiply=multiply)) if shrinks else texture

    number = resources.texture((image.as_pointer(), opaque), read)
    if opaque or not associated or _is_opaque(resources.textures[number]):
        return number, Alpha.PACKED
    if not wants_alpha:
        return number, Alpha.PACKED if multiply else Alpha.PREMULTIPLIED
    multiplied = multiplied or multiply
    return number, Alpha.MULTIPLIED if multiplied else Alpha.STRAIGHT


def _comes_multiplied(image: bpy.types.Image) -> bool:
    """Whether Cycles takes colours for multiplied by alpha. STRAIGHT floats that Blender hands to it are, and it multiplies them again."""
    return image.alpha_mode == "PREMUL" or (image.is_float and not _is_handed_over(image))


def _is_handed_over(image: bpy.types.Image) -> bool:
    """Whether Cycles gets the texels from Blender; it reads other files itself."""
    return image.packed_file is not None or image.source == "GENERATED"


def _check(at: At, image: bpy.types.Image | None) -> None:
    if image is None:
        at.note("no image: magenta stands in, as in Cycles")
    elif not image.size[0]:
        at.note(f"image '{image.name}' cannot be read ({image.filepath or 'no file'}): magenta stands in, as in Cycles")
    elif image.source == "TILED":
        at.note(f"image '{image.name}' has several tiles: the first is repeated")
    elif image.source in ("SEQUENCE", "MOVIE"):
        at.note(f"image '{image.name}' is animated: the frame that is loaded stands in")
    elif not image.is_float and image.colorspace_settings.name not in ("sRGB", *_LINEAR):
        at.note(f"image '{image.name}' has colour space {image.colorspace_settings.name}: sRGB stands in")


def _texture(image: bpy.types.Image, *, opaque: bool, multiplied: bool) -> Texture:
    texels = _pixels(image)
    if image.is_float:
        texels[~np.isfinite(texels).all(axis=2)] = 0.0  # as in Cycles: what a faulty texel has of colour is not to be trusted either
    if multiplied and not image.is_float and not _is_handed_over(image):
        texels[..., :3] *= texels[..., 3:]  # which Blender has divided by; rounded, these are the codes in the file
    if opaque or image.alpha_mode == "NONE":
        texels[..., 3] = 1.0
    if image.is_float:
        return Texture(image.name, False, texels)
    return Texture(image.name, image.colorspace_settings.name not in _LINEAR, (texels * 255 + 0.5).astype(np.uint8))


def _pixels(image: bpy.types.Image) -> np.ndarray:
    """(H, W, 4) float32, top row first: of 8-bit images the codes over 255; of others linear colours."""
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
