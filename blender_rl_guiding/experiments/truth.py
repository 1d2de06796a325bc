"""The true radiance that arrives at a point of a surface, measured once and kept beside the results."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..errors import InputError, trying_to
from ..guiding.patches import hemisphere
from ..notices import tell
from ..render import render
from ..render.checkpoint import program
from ..report.result_file import load_sealed, write_sealed
from ..scene.data import SceneData
from ..scene.description import Camera, Film
from ..settings import Machine, Render
from .probe import LUMINANCE, Point, find, rounded

ROWS, COLUMNS = 60, 120  # of the truth: a patch of most methods is a union of whole patches of this grid
SPP = 128
LIFT = 1e-3  # distance of the camera from the surface, relative to the scene's size


def above(scene: SceneData, point: Point, rows: int, columns: int) -> Camera:
    """A camera just above a point. Its pixels are patches of the hemisphere, with the last row on top."""
    low, high = scene.bounds
    lifted = point.position + LIFT * float((high - low).max()) * point.normal
    return hemisphere(scene.origin.astype(np.float64) + lifted, point.normal, rows, columns)


def frame(scene: SceneData, point: Point) -> tuple[list[float], list[float]]:
    """Right and up in a picture of the point's hemisphere: tangent and bitangent in world space."""
    axes = np.array(above(scene, point, 1, 1).to_world)
    return axes[:3, 0].tolist(), axes[:3, 1].tolist()


def arriving(scene: SceneData, point: Point, max_bounces: int, machine: Machine) -> np.ndarray:
    """The true mean radiance that arrives through each patch of a fine grid, (ROWS, COLUMNS) float32, luminance; row 0 at the horizon."""
    looking = replace(scene, camera=above(scene, point, ROWS, COLUMNS), film=Film())
    return render(looking, Render(spp=SPP, nee=True, max_bounces=max_bounces), machine).image[::-1] @ LUMINANCE


@dataclass(frozen=True)
class _File:
    """A probe.json."""

    scene_key: str
    pixel: tuple[int, int]
    max_bounces: int
    spp: int
    patches: tuple[int, int]
    program: str  # see `checkpoint.program`
    position: tuple[float, float, float]  # in world space, like all vectors below
    normal: tuple[float, float, float]
    right: tuple[float, float, float]
    up: tuple[float, float, float]
    radiance: tuple[float, ...]
    sha256: str


def kept(path: Path, scene: SceneData, pixel: tuple[int, int], max_bounces: int, machine: Machine) -> Point | None:
    """The point of `find`. Afterwards the file `path` holds the truth at this point. It is measured if the file is missing or has another
    truth.

    If the file is damaged, a line says so. If there is no point, the file is removed.
    """
    about = {
        "scene_key": scene.key,
        "pixel": pixel,
        "max_bounces": max_bounces,
        "spp": SPP,
        "patches": (ROWS, COLUMNS),
        "program": program(),
    }
    before = _read(path)
    if before and all(getattr(before, name) == value for name, value in about.items()):
        position, normal = np.array(before.position) - scene.origin, np.array(before.normal)
        return Point(pixel, position.astype(np.float32), normal.astype(np.float32))
    point = find(scene, pixel, machine)
    if point is None:
        with trying_to(f"remove {path}"):
            path.unlink(missing_ok=True)
        return None
    right, up = frame(scene, point)
    position = scene.origin.astype(np.float64) + point.position
    values = about | {"position": position.tolist(), "normal": point.normal.tolist(), "right": right, "up": up}
    write_sealed(path, values | {"radiance": rounded(arriving(scene, point, max_bounces, machine))})
    return point


def _read(path: Path) -> _File | None:
    """The truth in a file. None if the file is missing, from an earlier version, or damaged; a line reports damage."""
    if not path.exists():
        return None
    try:
        return load_sealed(_File, path, "a probe")
    except InputError as error:
        tell(f"{error}; it is measured again")
        return None
