"""The sky of a Sky Texture node: Cycles renders it in a separate Blender, and the user's cache keeps it.

So it is exact for every model and every version of Blender, without a copy of Blender's tables.
"""

import contextlib
import hashlib
import json
import math
import os
from pathlib import Path
from typing import Any, NamedTuple

import bpy
import numpy as np

from blender_rl_guiding.cache import dispensable, folder
from blender_rl_guiding.errors import InputError, atomic
from blender_rl_guiding.leftovers import temporary_folder
from blender_rl_guiding.notices import tell
from blender_rl_guiding.npz import opened
from blender_rl_guiding.scene.data import TABLE_SIZE
from blender_rl_guiding.scene.description import Color

from . import by_cycles
from .stop import Stop, never

_SHAPES = {"picture": (256, 512, 3), "disc": (TABLE_SIZE, 3)}
_KEPT = 64  # skies of 1.6 MB; an animated sun makes one for each frame
_SMALLEST = 0.0005  # radians: Cycles' minimal size of a sun's disc
# For a new node of each model: the mean colour of the sky over all directions, and of the sun. Used if there is no picture.
_USUAL = {
    "SINGLE_SCATTERING": ((2.08, 2.07, 2.01), (9.76, 7.08, 3.95)),
    "MULTIPLE_SCATTERING": ((1.93, 2.58, 3.49), (10.1, 7.45, 4.22)),
    "NISHITA": ((2.11, 2.08, 2.00), (9.66, 6.99, 3.88)),  # the name of SINGLE_SCATTERING before Blender 5.0
    "PREETHAM": ((0.597, 0.679, 0.997), (0.0, 0.0, 0.0)),
    "HOSEK_WILKIE": ((0.083, 0.154, 0.219), (0.0, 0.0, 0.0)),
}
# Models without a disc; the property sun_direction sets their sun.
_BY_DIRECTION = ("PREETHAM", "HOSEK_WILKIE")


class Sky(NamedTuple):
    """A sky, and the sun that may be added to it."""

    picture: np.ndarray  # (256, 512, 3) float32, top row first, for `Projection.HORIZON`
    disc: np.ndarray  # (256, 3) float32, upwards through the sun's disc at intensity 1, see `sun_disc` of `scene.ops`; 0 without a sun
    rotation: float  # radians around z, from the node's sun to the picture's sun above +y
    elevation: float  # radians, at most pi / 2 from the horizon
    size: float  # radians across the disc


def read_sky(node: bpy.types.Node, stop: Stop = never) -> Sky:
    """The sky of a node. InputError if there is none. Raises Stopped as `by_cycles.render` does."""
    values = _values(node)
    # An elevation beyond the zenith puts the sun on the other side.
    elevation, size = math.asin(math.sin(node.sun_elevation)), max(node.sun_size, _SMALLEST)
    rotation = node.sun_rotation
    if math.cos(node.sun_elevation) < 0:
        rotation += math.pi
    if node.sky_type in _BY_DIRECTION:
        rotation = 0.0
    values |= {"sun_elevation": elevation, "sun_rotation": 0.0, "sun_size": size, "sun_intensity": 1.0}
    arrays = _kept(values, stop)
    return Sky(arrays["picture"][::-1], arrays["disc"], rotation, elevation, size)


def _values(node: bpy.types.Node) -> dict[str, Any]:
    """The properties that only this kind of node has."""
    own = [p for p in node.bl_rna.properties if p.identifier not in bpy.types.Node.bl_rna.properties and p.type != "POINTER"]
    return {p.identifier: list(value) if getattr(p, "is_array", False) else value for p in own for value in [getattr(node, p.identifier)]}


def usual_color(node: bpy.types.Node) -> Color:
    """The mean over all directions, sun included, of a new node of the same model."""
    sky, sun = _USUAL.get(node.sky_type, _USUAL["MULTIPLE_SCATTERING"])
    intensity = node.sun_intensity if node.sun_disc else 0.0
    red, green, blue = (a + intensity * b for a, b in zip(sky, sun, strict=True))
    return red, green, blue


# --- the cache -------------------------------------------------------------------------------------------------------


def _kept(values: dict[str, Any], stop: Stop) -> dict[str, np.ndarray]:
    """The pictures for a node's properties, from the cache; new pictures if they are missing or damaged."""
    made_by = bpy.app.version_string, str(bpy.app.build_hash), os.environ.get("OCIO"), by_cycles.SCRIPT.read_text(encoding="utf-8")
    key = hashlib.sha256(json.dumps([values, made_by], sort_keys=True).encode()).hexdigest()
    skies = folder("skies")
    path = skies / f"{key}.npz" if skies else None
    if path and path.exists():
        try:
            return _read(path)
        except InputError as error:
            tell(f"{error}; the sky is made again")
    with temporary_folder() as place:
        arrays = by_cycles.render({"sky": values}, Path(place, "sky.npz"), stop, **_SHAPES)
    if path:
        with dispensable(path), atomic(path, durable=False) as part:
            everything: dict[str, Any] = arrays | {"sha256": np.array(_digest(path, arrays))}
            np.savez(part, **everything)
        _let_go(path.parent)
    return arrays


def _read(path: Path) -> dict[str, np.ndarray]:
    """A sky from the cache. InputError if the file cannot be read, or has changed."""
    with opened(path, "a sky") as file:
        arrays = {name: file.array(name, [np.float32], shape) for name, shape in _SHAPES.items()}
        if file.text("sha256") != _digest(path, arrays):
            raise ValueError("it is not as it was written")
    return arrays


def _digest(path: Path, arrays: dict[str, np.ndarray]) -> str:
    """The checksum of the arrays and of the file's name. The name is the key, so a renamed file does not pass as another sky."""
    return hashlib.sha256(path.name.encode() + b"".join(array.tobytes() for array in arrays.values())).hexdigest()


def _let_go(folder: Path) -> None:
    """Remove all files except the newest. Another process may do the same at this time."""
    with contextlib.suppress(OSError):
        newest = sorted(folder.glob("[!.]*.npz"), key=lambda file: file.stat().st_mtime, reverse=True)
        for file in newest[_KEPT:]:
            file.unlink()
