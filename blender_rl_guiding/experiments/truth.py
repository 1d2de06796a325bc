"""The radiance that truly arrives at a point of a surface, measured once and kept beside the results."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import atomic
from ..guiding.patches import hemisphere
from ..render import render
from ..scene.data import SceneData
from ..scene.description import Camera, Film
from ..settings import Machine, Render
from .probe import LUMINANCE, Point, find, rounded

ROWS, COLUMNS = 60, 120  # of the truth: the patches of most methods are made of whole ones of these
SPP = 128
LIFT = 1e-3  # of the scene's size, from the surface to where the truth is measured


def above(scene: SceneData, point: Point, rows: int, columns: int) -> Camera:
    """A camera just above a point whose pixels are patches of the hemisphere, the last row on top."""
    low, high = scene.bounds
    lifted = point.position + LIFT * float((high - low).max()) * point.normal
    return hemisphere(scene.origin.astype(np.float64) + lifted, point.normal, rows, columns)


def frame(scene: SceneData, point: Point) -> tuple[list[float], list[float]]:
    """What is to the right and up in a picture of the point's hemisphere: tangent and bitangent in world space."""
    axes = np.array(above(scene, point, 1, 1).to_world)
    return axes[:3, 0].tolist(), axes[:3, 1].tolist()


def arriving(scene: SceneData, point: Point, max_bounces: int, machine: Machine) -> np.ndarray:
    """The true mean radiance that arrives through each patch of a fine grid, (ROWS, COLUMNS) float32, luminance; row 0 at the horizon."""
    looking = replace(scene, camera=above(scene, point, ROWS, COLUMNS), film=Film())
    return render(looking, Render(spp=SPP, nee=True, max_bounces=max_bounces), machine).image[::-1] @ LUMINANCE


def kept(path: Path, scene: SceneData, pixel: tuple[int, int], max_bounces: int, machine: Machine) -> Point | None:
    """The point of `find`, with the truth in the file `path`: as it stands there if it is of just this, or else measured and written.

    Where there is no point there will be no file.
    """
    about = {"scene_key": scene.key, "pixel": list(pixel), "max_bounces": max_bounces, "spp": SPP, "patches": [ROWS, COLUMNS]}
    try:
        before = json.loads(path.read_text(encoding="utf-8"))
        if before.items() >= about.items():
            position, normal = np.array(before["position"]) - scene.origin, np.array(before["normal"])
            return Point(pixel, position.astype(np.float32), normal.astype(np.float32))
    except (OSError, ValueError, KeyError, AttributeError):
        pass  # there is none, or no such file
    point = find(scene, pixel, machine)
    if point is None:
        path.unlink(missing_ok=True)
        return None
    right, up = frame(scene, point)
    position = scene.origin.astype(np.float64) + point.position
    values = about | {"position": position.tolist(), "normal": point.normal.tolist(), "right": right, "up": up}
    values["radiance"] = rounded(arriving(scene, point, max_bounces, machine))
    with atomic(path) as part:
        part.write_text(json.dumps(values), encoding="utf-8")
    return point
