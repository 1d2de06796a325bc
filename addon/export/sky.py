"""What Cycles makes of a Sky Texture node, asked of a Blender of its own and kept in the user's cache.

A scene with nothing but the node is rendered there: exact for every model and version of Blender, and nobody's tables are copied.
"""

import contextlib
import hashlib
import json
import math
import os
import subprocess
import sys
import tempfile
import zipfile
import zlib
from pathlib import Path
from typing import Any, NamedTuple

import bpy
import numpy as np

from blender_rl_guiding.cache import cache_home
from blender_rl_guiding.errors import InputError, atomic
from blender_rl_guiding.scene.data import TABLE_SIZE
from blender_rl_guiding.scene.description import Color

_SCRIPT = Path(__file__).resolve().parents[1] / "sky_picture.py"
_SHAPES = {"sky": (256, 512, 3), "disc": (TABLE_SIZE, 3)}  # of float32
_PATIENCE = 120.0  # seconds; a second or two are enough where the machine has nothing else to do
_KEPT = 100  # skies, a megabyte each: an animated sun makes one a frame
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
_DAMAGE = (zipfile.BadZipFile, zlib.error, EOFError, LookupError, ValueError, NotImplementedError)


class Sky(NamedTuple):
    """A sky, and the sun that may be added to it."""

    picture: np.ndarray  # (256, 512, 3) float32, top row first, for `Projection.HORIZON`
    disc: np.ndarray  # (256, 3) float32, across the sun's disc from below for an intensity of 1, see `sun_disc` of `scene.ops`; 0 without
    rotation: float  # radians around z, which take the sun to above +y, where it is in the picture
    elevation: float  # radians, at most pi / 2 from the horizon
    size: float  # radians across the disc


def read_sky(node: bpy.types.Node) -> Sky:
    """The sky of a node. InputError says in one line why there is none."""
    values = _values(node)
    # An elevation beyond the zenith is one on the other side.
    elevation, beyond = math.asin(math.sin(node.sun_elevation)), math.cos(node.sun_elevation) < 0
    rotation, size = node.sun_rotation + math.pi * beyond, max(node.sun_size, _SMALLEST)
    if node.sky_type in _BY_DIRECTION:
        rotation = 0.0
    values |= {"sun_elevation": elevation, "sun_rotation": 0.0, "sun_size": size, "sun_intensity": 1.0}
    arrays = _kept(values)
    return Sky(arrays["sky"][::-1], arrays["disc"], rotation, elevation, size)


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


def _kept(values: dict[str, Any]) -> dict[str, np.ndarray]:
    """What the child makes of a node's properties, made anew where it is not kept, or damaged."""
    asked = json.dumps(values | {"blender": [bpy.app.version_string, str(bpy.app.build_hash), os.environ.get("OCIO")]}, sort_keys=True)
    path = cache_home() / "skies" / f"{hashlib.sha256(asked.encode() + _SCRIPT.read_bytes()).hexdigest()}.npz"
    with contextlib.suppress(OSError, *_DAMAGE):
        return _loaded(path)
    with tempfile.TemporaryDirectory(prefix="rl_guided-") as folder:
        made = Path(folder, "sky.npz")
        _make(values, made)
        try:
            arrays = _loaded(made)
        except (OSError, *_DAMAGE) as error:
            raise InputError(f"the Blender that renders it left something else ({' '.join(str(error).split())})") from error
        with contextlib.suppress(InputError), atomic(path) as part:  # without a cache it takes longer, no more
            part.write_bytes(made.read_bytes())
            _let_go(path.parent)
    return arrays


def _loaded(path: Path) -> dict[str, np.ndarray]:
    with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
        arrays = {name: file[name] for name in _SHAPES}
    for name, array in arrays.items():
        if array.shape != _SHAPES[name] or array.dtype != np.float32 or not np.isfinite(array).all():
            raise ValueError(f"{name} is {array.dtype}{array.shape}, or not finite")
    return arrays


def _let_go(folder: Path) -> None:
    """Remove all but the newest."""
    ages = sorted((file.stat().st_mtime, file) for file in folder.glob("[!.]*.npz"))
    for _, file in ages[:-_KEPT]:
        file.unlink(missing_ok=True)


# --- the child -------------------------------------------------------------------------------------------------------


def _make(values: dict[str, Any], path: Path) -> None:
    """Have a Blender of this kind, without a window, write the arrays. InputError names what it complained of."""
    parameters = path.with_suffix(".json")
    parameters.write_text(json.dumps(values), encoding="utf-8")
    if bpy.app.binary_path:
        command = [bpy.app.binary_path, "--background", "--factory-startup", "--python-exit-code", "1", "--python", str(_SCRIPT), "--"]
    else:
        command = [sys.executable, str(_SCRIPT)]  # the bpy module
    try:
        done = subprocess.run([*command, str(parameters), str(path)], stdin=subprocess.DEVNULL, capture_output=True, timeout=_PATIENCE, check=False)
    except subprocess.TimeoutExpired as error:
        raise InputError(f"the Blender that renders it was not done after {_PATIENCE:g} seconds") from error
    except OSError as error:
        raise InputError(f"cannot start Blender, {command[0]}: {error.strerror or error}") from error
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise InputError(f"the Blender that renders it failed with status {done.returncode}{': ' if said else ''}{said[-1] if said else ''}")
