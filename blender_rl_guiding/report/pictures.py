"""Pictures for a page of text: data URIs of images and error maps, and pixels that the page's own viewer can read."""

import base64
import zlib
from collections.abc import Iterable

import matplotlib
import numpy as np

from ..images import png, to_display

# Black to yellow through purple, even in lightness, readable with any colour vision: 256 sRGB codes.
COLOURS = (matplotlib.colormaps["inferno"](np.arange(256))[:, :3] * 255.0 + 0.5).astype(np.uint8)


def uri(pixels: np.ndarray) -> str:
    """A data URI of (H, W, 3) uint8 codes, or (H, W, 4) with coverage."""
    return "data:image/png;base64," + base64.b64encode(png(pixels)).decode()


def photo(image: np.ndarray) -> str:
    """A data URI of a linear image as sRGB."""
    return uri(to_display(image))


def heat(errors: np.ndarray, top: float) -> str:
    """A data URI of `heat_map`."""
    return uri(heat_map(errors, top))


def heat_map(errors: np.ndarray, top: float) -> np.ndarray:
    """A map of errors (H, W) in colours, (H, W, 3) uint8; 0 is black, `top` and above yellow."""
    return COLOURS[(np.clip(errors / top, 0.0, 1.0) * 255.0).astype(np.uint8)]


def scale(maps: Iterable[np.ndarray]) -> float:
    """The top of a scale for all maps: 95 % of the worst one's pixels lie below; 1, 2 or 5 times a power of ten."""
    high = max((float(np.percentile(m, 95)) for m in maps), default=0.0)
    if high <= 0.0:
        return 1.0
    decade = 10.0 ** np.floor(np.log10(high))
    return next(float(step * decade) for step in (1, 2, 5, 10) if step * decade >= high * 0.999)


def rgbe(image: np.ndarray) -> str:
    """Linear pixels as base64 of deflated planes R, G, B, E: value = code * 2^(E - 136); relative precision 1 / 256."""
    rgb = np.maximum(image.astype(np.float64), 0.0)
    exponent = np.clip(np.frexp(rgb.max(axis=-1))[1], -127, 127)
    codes = np.clip(np.rint(np.ldexp(rgb, 8 - exponent[..., None])), 0, 255)
    planes = np.concatenate([codes.transpose(2, 0, 1), exponent[None] + 128]).astype(np.uint8)
    return base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode()
