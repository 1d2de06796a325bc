"""Pixels as text in a page: data URIs, and planes for the page's own viewer. Colours of methods and of error maps."""

import base64
import zlib
from collections.abc import Iterable

import matplotlib
import numpy as np

from ..images import png, to_display
from .charts import round_step

# Colours of methods on light and on dark pages. The first is grey, for the baseline.
LIGHT = ("#7a808a", "#2b6cb0", "#d9730d", "#1a7f4b", "#a13ea8", "#b7312c", "#0e8fa8", "#8a7a00", "#d6568f", "#7b4a2b")
DARK = ("#969ca5", "#79b4ee", "#f0a35a", "#5fc98f", "#d793dd", "#f08a84", "#5cc8dc", "#d2c15a", "#f49ac0", "#c9a07c")
# 256 sRGB codes from black over purple to yellow, with evenly increasing lightness, readable with any colour vision.
COLOURS = (matplotlib.colormaps["inferno"](np.arange(256))[:, :3] * 255.0 + 0.5).astype(np.uint8)


def uri(pixels: np.ndarray) -> str:
    """A data URI of (H, W, 3) uint8 codes, or (H, W, 4) with coverage."""
    return "data:image/png;base64," + base64.b64encode(png(pixels)).decode()


def photo(image: np.ndarray) -> str:
    """A data URI of a linear image as sRGB."""
    return uri(to_display(image))


def heat_map(errors: np.ndarray, top: float) -> np.ndarray:
    """A map of errors (H, W) in colours, (H, W, 3) uint8; 0 is black, `top` and above yellow."""
    return COLOURS[(np.clip(errors / top, 0.0, 1.0) * 255.0).astype(np.uint8)]


def scale(maps: Iterable[np.ndarray]) -> float:
    """The top of a common scale for all maps, 1, 2 or 5 times a power of ten. At least 95 % of the pixels of each map lie below it."""
    high = max((float(np.percentile(m, 95)) for m in maps), default=0.0)
    if high <= 0.0:
        return 1.0
    return round_step(high)


def rgbe(image: np.ndarray) -> str:
    """Linear pixels as base64 of deflated planes R, G, B, E: value = code * 2^(E - 136); relative precision 1 / 256."""
    rgb = np.maximum(image.astype(np.float64), 0.0)
    exponent = np.clip(np.frexp(rgb.max(axis=-1))[1], -127, 127)
    codes = np.clip(np.rint(np.ldexp(rgb, 8 - exponent[..., None])), 0, 255)
    planes = np.concatenate([codes.transpose(2, 0, 1), exponent[None] + 128]).astype(np.uint8)
    return base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode()
