"""Reads and writes images: OpenEXR for linear values, PNG for viewing. Images are (H, W, 3) float32, linear RGB, top row first."""

import contextlib
import hashlib
import io
import os
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import OpenEXR
from PIL import Image

from ..errors import InputError, atomic, trying_to
from ..layers import LAYERS
from ..memory import available, in_words


def write_exr(path: Path, image: np.ndarray, header: Mapping[str, str]) -> None:
    """Write 32-bit R, G, B, and A if the image has alpha, with `header` as string attributes. InputError if it cannot be written."""
    _write(path, {"RGB" if image.shape[2] == 3 else "RGBA": image}, header)


def write_layers(path: Path, layers: Mapping[str, np.ndarray], header: Mapping[str, str]) -> None:
    """Write passes, (H, W) or (H, W, channels), as a multi-layer file that Blender and its compositor read."""
    channels = {
        f"ViewLayer.{name}.{channel}": pixels if pixels.ndim == 2 else pixels[..., k]
        for name, pixels in layers.items()
        for k, channel in enumerate(LAYERS.get(name, "RGBA" if pixels.ndim == 3 and pixels.shape[2] == 4 else "RGB"))
    }
    _write(path, channels, {**header, "BlenderMultiChannel": "Blender V2.55.1 and newer"})


def _write(path: Path, channels: Mapping[str, np.ndarray], header: Mapping[str, str]) -> None:
    attributes = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    pixels = {name: np.ascontiguousarray(array, np.float32) for name, array in channels.items()}
    with atomic(path) as part:
        part.touch()  # opened first, because the system gives a reason for a failure and OpenEXR does not
        try:
            with _quiet(), OpenEXR.File(attributes, pixels) as file:
                file.write(str(part))
        except RuntimeError as error:
            raise InputError(f"cannot write {path}: {error}") from error


def read_exr(path: Path) -> tuple[np.ndarray, dict[str, str]]:
    """Read the image and the string attributes of an EXR file.

    Takes channels R, G, B of any part and precision, or those of the pass Combined in Blender's multi-layer files; alpha
    is left out. InputError on a file that cannot be read, is damaged, or has no such channels.
    """
    try:
        with trying_to(f"read {path}"):
            if not stat.S_ISREG(path.stat().st_mode):
                raise OSError("it is not a file")
            path.open("rb").close()
            _check_memory(path)
            with _quiet(), OpenEXR.File(str(path), separate_channels=True) as file:
                return _rgb(file.parts, path), {k: v for k, v in file.header().items() if isinstance(v, str)}
    except (RuntimeError, ValueError) as error:
        raise InputError(f"{path}: not an EXR image, or damaged") from error


def sha256(image: np.ndarray) -> str:
    """The checksum of an image's pixels, (H, W, 3) float32."""
    return hashlib.sha256(np.ascontiguousarray(image).data).hexdigest()


def read_own(path: Path) -> tuple[np.ndarray, dict[str, str]]:
    """`read_exr` of a file with the attribute "sha256". InputError unless it is the checksum of the pixels."""
    image, header = read_exr(path)
    if header.get("sha256") != sha256(image):
        raise InputError(f"{path}: the pixels are not those that were written")
    return image, header


def _check_memory(path: Path) -> None:
    """InputError if all channels and the image, at 32 bits, do not fit into memory."""
    taken = 0
    with _quiet(), OpenEXR.File(str(path), header_only=True) as file:
        for part in file.parts:
            first, last = part.header["dataWindow"]
            width, height = (last.astype(int) - first + 1).tolist()
            taken += 4 * width * height * (len(part.header["channels"]) + 3)
    if taken > (free := available()):
        raise InputError(f"{path} takes {in_words(taken)} of memory, but only {in_words(free)} are free")


def _rgb(parts: list[OpenEXR.Part], path: Path) -> np.ndarray:
    channels = {name: channel.pixels for part in parts for name, channel in part.channels.items()}
    layers = ["", *(name.removesuffix("R") for name in channels if name.endswith(".Combined.R"))]
    for layer in layers:
        names = [layer + c for c in "RGB"]
        if channels.keys() >= set(names):
            return np.stack([channels[name] for name in names], axis=-1).astype(np.float32)
    raise InputError(f"{path}: no channels R, G, B or Combined among {', '.join(channels) or 'none, or damaged'}")


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Suppress OpenEXR's output about a bad file. Some goes through Python's stdout, some directly to descriptor 2."""
    with contextlib.redirect_stdout(io.StringIO()), open(os.devnull, "wb") as sink:
        stderr = os.dup(2)
        os.dup2(sink.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(stderr, 2)
            os.close(stderr)


def to_display(linear: np.ndarray) -> np.ndarray:
    """Linear values of any shape, clipped to 0..1, as 8-bit sRGB codes."""
    x = np.clip(linear, 0.0, 1.0)
    codes = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return (codes * 255.0 + 0.5).astype(np.uint8)


def png(pixels: np.ndarray) -> bytes:
    """A PNG file's bytes from (H, W, 3) uint8 codes, or (H, W, 4) with coverage."""
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG")
    return buffer.getvalue()


def write_png(path: Path, image: np.ndarray) -> None:
    """Write a linear image, (H, W, 3) or (H, W, 4), as sRGB PNG, clipped to 0..1. InputError if the file cannot be written.

    Colours in the image are multiplied by alpha, as everywhere in this package. Colours in a PNG file are not.
    """
    codes = to_display(image if image.shape[2] == 3 else np.dstack([image[..., :3] / np.maximum(image[..., 3:], 1e-6), image[..., 3:]]))
    if image.shape[2] == 4:
        codes[..., 3] = (np.clip(image[..., 3], 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)  # alpha is stored without gamma
    with atomic(path) as part:
        part.write_bytes(png(codes))
