"""Starts a second Blender that renders pictures with Cycles, because Blender cannot start a render during another one."""

import json
import time
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from blender_rl_guiding.children import Child, running
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.leftovers import temporary_folder
from blender_rl_guiding.strings import one_line

from ..another_blender import command
from .stop import Stop, Stopped, never

SCRIPT = Path(__file__).resolve().parents[1] / "cycles_pictures.py"
# Errors of `read` if the file does not contain the expected arrays.
DAMAGE = (OSError, zipfile.BadZipFile, zlib.error, EOFError, LookupError, ValueError, NotImplementedError)
_PATIENCE = 120.0  # seconds; one or two are enough on an idle machine
_LOOK = 0.1  # seconds between two calls of `stop`


def render(job: dict[str, Any], path: Path, stop: Stop = never, **shapes: tuple[int, ...]) -> dict[str, np.ndarray]:
    """Let the script render the pictures of a job into a file, and read the file. InputError if there are no pictures.

    Raises Stopped if the user cancels.
    """
    with temporary_folder() as folder:
        written = Path(folder, "job.json")
        written.write_text(json.dumps(job), encoding="utf-8")
        _run([str(written), str(path)], stop)
    try:
        return read(path, **shapes)
    except DAMAGE as error:
        raise InputError(f"Blender left no pictures: {one_line(error)}") from error


def read(path: Path, **shapes: tuple[int, ...]) -> dict[str, np.ndarray]:
    """Arrays by name. Raises one of `DAMAGE` unless all exist, are float32 and finite, and have these shapes."""
    with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
        arrays = {name: file[name] for name in shapes}
    for name, array in arrays.items():
        if array.shape != shapes[name] or array.dtype != np.float32 or not np.isfinite(array).all():
            raise ValueError(f"{name} is {array.dtype}{array.shape}, or not finite")
    return arrays


def opaque(colors: np.ndarray) -> np.ndarray:
    """Colours, (..., 3), with an alpha of 1: (..., 4)."""
    return np.concatenate([colors, np.ones_like(colors[..., :1])], axis=-1)


def _run(arguments: list[str], stop: Stop) -> None:
    """Run the script in another Blender."""
    with running([*command(SCRIPT), *arguments]) as child:
        _wait(child, stop)
        if child.process.returncode:
            raise InputError(f"Blender {child.fate()}")


def _wait(child: Child, stop: Stop) -> None:
    """Wait for the end of a child. InputError if it takes too long."""
    end = time.monotonic() + _PATIENCE
    while not child.ended(_LOOK):
        if stop():
            raise Stopped
        if time.monotonic() > end:
            raise InputError(f"Blender was not done after {_PATIENCE:g} seconds")
