"""A probe: the surface point behind a pixel, and the guide's Q at this point."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..errors import InputError
from ..guiding.base import Guide
from ..images.metrics import LARGEST
from ..kernels import sampling
from ..render import render
from ..scene.data import SceneData
from ..scene.description import Camera, Film
from ..settings import Machine, Render

LUMINANCE = np.array(sampling.LUMINANCE, np.float32)


@dataclass(frozen=True, eq=False)
class Point:
    """Where a pixel's ray meets its first surface."""

    pixel: tuple[int, int]  # column and row, from the top left
    position: np.ndarray  # (3,) float32, from the scene's origin
    normal: np.ndarray  # (3,) float32, unit: the shading normal on the camera's side


class View(NamedTuple):
    """The first surface behind each pixel, along one ray."""

    position: np.ndarray  # (H, W, 3) float32, from the scene's origin
    normal: np.ndarray  # (H, W, 3) float32, unit; 0 if there is no surface
    emits: np.ndarray  # (H, W) bool, whether emission > reflection of radiance 1, so that a weak glow does not count
    reflects: np.ndarray  # (H, W) bool, whether it reflects and is not in `emits`


def view(scene: SceneData, machine: Machine) -> View:
    """The first surfaces along the rays through the pixels' centres."""
    layers = render(
        replace(scene, film=Film("gaussian", filter_width=1e-6)), Render(spp=1, max_bounces=0, passes=True), machine
    ).film.layers()
    emission, albedo = layers["Emission"] @ LUMINANCE, layers["Albedo"] @ LUMINANCE
    emits = emission > albedo
    return View(layers["Position"] - scene.origin, layers["Normal"], emits, (albedo > 0) & ~emits)


def pixel_of(scene: SceneData, asked: Sequence[int] | None) -> tuple[int, int]:
    """The pixel to probe: the given one, or the middle of the width at four fifths of the height. InputError if it lies outside."""
    width, height = scene.camera.width, scene.camera.height
    x, y = asked or (width // 2, height * 4 // 5)
    if not (0 <= x < width and 0 <= y < height):
        raise InputError(f"pixel ({x}, {y}) is not one of the {width} x {height} of scene {scene.name!r}")
    return x, y


def find(scene: SceneData, pixel: tuple[int, int], machine: Machine) -> Point | None:
    """The point behind a pixel of the image. None if there is no surface, or if the surface emits or does not reflect."""
    seen = view(replace(scene, camera=_cropped(scene.camera, *pixel)), machine)
    return Point(pixel, seen.position[0, 0], seen.normal[0, 0]) if seen.reflects[0, 0] else None


def _cropped(camera: Camera, x: int, y: int) -> Camera:
    """The camera of that one pixel."""
    left, right, bottom, top = camera.window
    wide, high = (right - left) / camera.width, (top - bottom) / camera.height
    window = left + x * wide, left + (x + 1) * wide, top - (y + 1) * high, top - y * high
    return replace(camera, window=window, width=1, height=1)


def described(guide: Guide, point: Point | None) -> dict[str, Any] | None:
    """The guide's Q at a point as plain data, for result.json; None if the guide does not know the point."""
    learnt = guide.learnt(point.position, point.normal) if point else None
    if not point or not learnt:
        return None
    rows, columns = learnt.radiance.shape
    return {"pixel": point.pixel, "rows": rows, "columns": columns, "q": rounded(learnt.radiance)}


def rounded(values: np.ndarray) -> list[float]:
    """All values with five digits, clipped to `LARGEST`, for files."""
    return [float(f"{value:.5g}") for value in values.ravel().clip(-LARGEST, LARGEST)]
