"""A probe: the point of a surface that a pixel sees, and what a guide has learnt of the radiance that arrives there."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from ..errors import InputError
from ..guiding.base import Guide
from ..guiding.cells import CellTable
from ..guiding.directions import UNKNOWN
from ..images.metrics import LARGEST
from ..kernels import sampling
from ..render import render
from ..scene.data import SceneData
from ..scene.description import Camera, Film
from ..settings import DQN, Machine, QTable, Render
from ..settings import Guide as GuideSettings

LUMINANCE = np.array(sampling.LUMINANCE, np.float32)


@runtime_checkable
class Learner(Guide, Protocol):
    """A guide that can be asked what it has learnt."""

    @property
    def cells(self) -> CellTable:
        """The states."""
        ...

    def q(self) -> np.ndarray:
        """The estimate of the mean radiance through each patch of each cell, (C, N) float32."""
        ...


@dataclass(frozen=True, eq=False)
class Point:
    """Where a pixel's ray meets its first surface."""

    pixel: tuple[int, int]  # column and row, from the top left
    position: np.ndarray  # (3,) float32, from the scene's origin
    normal: np.ndarray  # (3,) float32, unit: the shading normal on the camera's side


class View(NamedTuple):
    """The first surface behind each pixel, along one ray."""

    position: np.ndarray  # (H, W, 3) float32, from the scene's origin
    normal: np.ndarray  # (H, W, 3) float32, unit; 0 where there is no surface
    emits: np.ndarray  # (H, W) bool, whether it shines brighter than it would reflect light of radiance 1: a lamp, not a glow
    reflects: np.ndarray  # (H, W) bool, whether it reflects, and is none of those


def view(scene: SceneData, machine: Machine) -> View:
    """What the camera sees through the pixels' centres."""
    layers = render(
        replace(scene, film=Film("gaussian", filter_width=1e-6)), Render(spp=1, max_bounces=0, passes=True), machine
    ).film.layers()
    emission, albedo = layers["Emission"] @ LUMINANCE, layers["Albedo"] @ LUMINANCE
    emits = emission > albedo
    return View(layers["Position"] - scene.origin, layers["Normal"], emits, (albedo > 0) & ~emits)


def pixel_of(scene: SceneData, asked: Sequence[int] | None) -> tuple[int, int]:
    """The pixel to probe: the one asked for, or the middle of the width at four fifths of the height. InputError where it lies outside."""
    width, height = scene.camera.width, scene.camera.height
    x, y = asked or (width // 2, height * 4 // 5)
    if not (0 <= x < width and 0 <= y < height):
        raise InputError(f"pixel ({x}, {y}) is not one of the {width} x {height} of scene {scene.name!r}")
    return x, y


def find(scene: SceneData, pixel: tuple[int, int], machine: Machine) -> Point | None:
    """The point that a pixel of the image sees; None where that is nothing, or nothing that reflects, or an emitter."""
    seen = view(replace(scene, camera=_cropped(scene.camera, *pixel)), machine)
    return Point(pixel, seen.position[0, 0], seen.normal[0, 0]) if seen.reflects[0, 0] else None


def _cropped(camera: Camera, x: int, y: int) -> Camera:
    """The camera of that one pixel."""
    left, right, bottom, top = camera.window
    wide, high = (right - left) / camera.width, (top - bottom) / camera.height
    window = left + x * wide, left + (x + 1) * wide, top - (y + 1) * high, top - y * high
    return replace(camera, window=window, width=1, height=1)


def learns(guide: GuideSettings) -> bool:
    """Whether a guide with these settings is a `Learner`."""
    return isinstance(guide, QTable | DQN)


def learnt(guide: Guide, point: Point) -> np.ndarray | None:
    """Q of the point's cell, (rows, columns) float32; None for a guide that does not learn, or knows nothing of the cell."""
    found = _cell(guide, point)
    return found and found[0].q()[found[1]].reshape(_grid(guide))


def chances(guide: Guide, point: Point) -> np.ndarray | None:
    """The probability with which the guide draws each patch at the point, (rows, columns) float32; None as for `learnt`."""
    found = _cell(guide, point)
    return found and np.diff(guide.directions().cdf[found[1]], prepend=np.float32(0)).reshape(_grid(guide))


def _cell(guide: Guide, point: Point) -> tuple[Learner, int] | None:
    """The guide and the row of the point's cell, if directions are laid out for any."""
    if not isinstance(guide, Learner):
        return None
    row = int(guide.cells.rows(point.position[None], point.normal[None])[0])
    taught = guide.directions().cells.per_metre > 0  # before the first lesson it has one cell, which is everywhere
    return (guide, row) if row != UNKNOWN and taught else None


def _grid(guide: Guide) -> tuple[int, int]:
    return guide.directions().patch_rows, guide.directions().patch_columns


def described(guide: Guide, point: Point | None) -> dict[str, Any] | None:
    """What a guide has learnt as plain data, for result.json."""
    q = learnt(guide, point) if point else None
    if q is None or not point:
        return None
    return {"pixel": point.pixel, "rows": len(q), "columns": q.shape[1], "q": rounded(q)}


def rounded(values: np.ndarray) -> list[float]:
    """All values with five digits, and none beyond `LARGEST`, as they stand in files."""
    return [float(f"{value:.5g}") for value in values.ravel().clip(-LARGEST, LARGEST)]
