"""What Cycles makes of a Sky Texture node, asked of a Blender of its own and kept in the user's cache.

A scene with nothing but the node is rendered there: exact for every model and version of Blender, and nobody's tables are copied.
"""

import contextlib
import hashlib
import json
import math
import os
import shutil
from pathlib import Path
from typing import Any, NamedTuple

import bpy
import numpy as np

from blender_rl_guiding.cache import cache_home
from blender_rl_guiding.errors import InputError, atomic
from blender_rl_guiding.leftovers import sweep, temporary_folder
from blender_rl_guiding.scene.data import TABLE_SIZE
from blender_rl_guiding.scene.description import Color

from . import by_cycles
from .stop import Stop, never

_SHAPES = {"picture": (256, 512, 3), "disc": (TABLE_SIZE, 3)}
_KEPT = 64  # skies of 1.6 MB: an animated sun makes one a frame
_SMALLEST = 0.0005  # radians, of a sun's disc: Cycles makes it no smaller
# Means over all directions of new nodes by their model, of the sky and of the sun: what stands in where there is no picture.
_USUAL = {
    "SINGLE_SCATTERING": ((2.08, 2.07, 2.01), (9.76, 7.08, 3.95)),
    "MULTIPLE_SCATTERING": ((1.93, 2.58, 3.49), (10.1, 7.45, 4.22)),
    "NISHITA": ((2.11, 2.08, 2.00), (9.66, 6.99, 3.88)),  # the name of SINGLE_SCATTERING before Blender 5.0
    "PREETHAM": ((0.597, 0.679, 0.997), (0.0, 0.0, 0.0)),
    "HOSEK_WILKIE": ((0.083, 0.154, 0.219), (0.0, 0.0, 0.0)),
}
# Models whose sun is where the property sun_direction has it, and has no disc.
_BY_DIRECTION = ("PREETHAM", "HOSEK_WILKIE")


class Sky(NamedTuple):
    """A sky, and the sun that may be added to it."""

    picture: np.ndarray  # (256, 512, 3) float32, top row first, for `Projection.HORIZON`
    disc: np.ndarray  # (256, 3) float32, across the sun's disc from below for an intensity of 1, see `sun_disc` of `scene.ops`; 0 without
    rotation: float  # radians around z, which take the sun to above +y, where it is in the picture
    elevation: float  # radians, at most pi / 2 from the horizon
    size: float  # radians across the disc


def read_sky(node: bpy.types.Node, stop: Stop = never) -> Sky:
    """The sky of a node. InputError says in one line why there is none. Stopped as in `by_cycles.render`."""
    values = _values(node)
    # An elevation beyond the zenith is one on the other side.
    elevation, beyond = math.asin(math.sin(node.sun_elevation)), math.cos(node.sun_elevation) < 0
    rotation, size = node.sun_rotation + math.pi * beyond, max(node.sun_size, _SMALLEST)
    if node.sky_type in _BY_DIRECTION:
        rotation = 0.0
    values |= {"sun_elevation": elevation, "sun_rotation": 0.0, "sun_size": size, "sun_intensity": 1.0}
    arrays = _kept(values, stop)
    return Sky(arrays["picture"][::-1], arrays["disc"], rotation, elevation, size)


def _values(node: bpy.types.Node) -> dict[str, Any]:
    """The properties that only a node of this kind has."""
    own = [p for p in node.bl_rna.properties if p.identifier not in bpy.types.Node.bl_rna.properties and p.type != "POINTER"]
    return {p.identifier: list(value) if getattr(p, "is_array", False) else value for p in own for value in [getattr(node, p.identifier)]}


def usual_color(node: bpy.types.Node) -> Color:
    """The mean over all directions, sun included, of the node's model with its other properties as they are in a new node."""
    sky, sun = _USUAL.get(node.sky_type, _USUAL["MULTIPLE_SCATTERING"])
    intensity = node.sun_intensity * node.sun_disc
    red, green, blue = (a + intensity * b for a, b in zip(sky, sun, strict=True))
    return red, green, blue


# --- the cache -------------------------------------------------------------------------------------------------------


def _kept(values: dict[str, Any], stop: Stop) -> dict[str, np.ndarray]:
    """The pictures of a node's properties, made anew where they are not kept, or damaged."""
    made_by = bpy.app.version_string, str(bpy.app.build_hash), os.environ.get("OCIO"), by_cycles.SCRIPT.read_text(encoding="utf-8")
    key = hashlib.sha256(json.dumps([values, made_by], sort_keys=True).encode()).hexdigest()
    path = cache_home() / "skies" / f"{key}.npz"
    with contextlib.suppress(*by_cycles.DAMAGE):
        return by_cycles.read(path, **_SHAPES)
    with temporary_folder() as folder:
        made = Path(folder, path.name)
        arrays = by_cycles.render({"sky": values}, made, stop, **_SHAPES)
        with contextlib.suppress(InputError), atomic(path) as part:  # without a cache it takes longer, no more
            shutil.copyfile(made, part)
    _let_go(path.parent)
    return arrays


def _let_go(folder: Path) -> None:
    """Remove all but the newest, and what killed processes left; another process may do so at the same time."""
    sweep(folder)
    with contextlib.suppress(OSError):
        newest = sorted(folder.glob("[!.]*.npz"), key=lambda file: file.stat().st_mtime, reverse=True)
        for file in newest[_KEPT:]:
            file.unlink()
