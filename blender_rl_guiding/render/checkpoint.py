"""Checkpoints: files that let an interrupted render go on to the same bits."""

import hashlib
import json
import os
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numba.core.registry import cpu_target

from .. import __version__
from .. import cache as caches
from ..errors import InputError, atomic
from ..guiding.saved import Saved, below, digest
from ..notices import tell
from ..npz import Archive, DamagedError, opened
from ..scene.data import SceneData
from ..schema import to_dict
from ..settings import Machine, Render
from ..typed import MalformedError, Range, parse, read
from .result import Result

SHARE = 100  # least time to the next checkpoint / time to write the last: checkpoints cost at most 1 % of the time
KEPT_DAYS = 30  # days in the cache: most checkpoints are never read again
KEPT = 8  # most checkpoints in the cache: each has up to 1.1 GB
_DECIDING = "numpy", "numba", "llvmlite", "torch", "embreex"  # packages that decide the bits of an image
_OTHER = {
    "scene": "of another scene",
    "settings": "of other settings",
    "program": "of another version of the program, or another processor",
    "judged_by": "judged by another reference",
}

Seconds = Annotated[float, Range(0, 1e8)]


@dataclass(frozen=True)
class _Header:
    """All of a checkpoint that is not an array."""

    about: dict[str, Any]  # what identifies the render, by the names in `_OTHER`
    digests: dict[str, str]  # `digest` of each array, by its name
    # As in `Result`:
    taken: Annotated[int, Range(1, 1 << 31)]
    seconds: Seconds
    learn_seconds: Seconds
    steps: Annotated[int, Range(0, 1 << 31)]
    rays: Annotated[int, Range(0, 1 << 62)]
    vertices_per_path: Annotated[float, Range(1e-15, 1e12)]
    curve: tuple[dict[str, int | float], ...]


_NUMBERS = "taken", "seconds", "learn_seconds", "steps", "rays", "vertices_per_path"  # of a result


class Checkpoint:
    """The checkpoint file of a render, and the time of its next write. The file is removed once the run is saved."""

    def __init__(self, path: Path, judged_by: str = "", dispensable: bool = False) -> None:
        """judged_by: the key of the reference that `on_pass` compares with; empty if there is none. dispensable: whether the render begins
        anew if the file cannot be read; otherwise `taken_up` raises InputError.
        """
        self.path, self.samples = path, 0  # samples per pixel in the file
        self._judged_by, self._dispensable = judged_by, dispensable
        self._about: dict[str, Any] = {}
        self._every = self._due = float("inf")
        self._failed = False

    def taken_up(self, scene: SceneData, settings: Render, machine: Machine, begun: Callable[[], Result]) -> Result | None:
        """Begin the checkpoints of a render. Returns the state in the file, or None if the file has no state of exactly this render.

        A line tells why a file is not used. InputError if the file cannot be read. begun: makes the state before the first pass.
        """
        self._about = about(scene, settings) | {"judged_by": self._judged_by}
        self._every = machine.checkpoint or float("inf")
        self._due = time.perf_counter() + self._every
        if not machine.checkpoint or not os.path.isfile(self.path):
            return None
        try:
            with opened(self.path, "a checkpoint") as file:
                header = _header(file)
                for name, other in _OTHER.items():
                    if header.about.get(name) != self._about[name]:
                        tell(f"{self.path} is {other}: the render begins anew")
                        return None
                result = _restored(header, file, begun(), settings)
        except InputError as error:
            if not (self._dispensable or isinstance(error, DamagedError)):
                raise InputError(f"{error}; --checkpoint 0 begins anew") from error
            tell(f"{error}: the render begins anew")
            return None
        self.samples = result.taken
        tell(f"goes on from {self.path}, after {self.samples} of {settings.spp} samples")
        return result

    def offer(self, result: Result) -> float:
        """Write the state if a checkpoint is due. Returns the seconds that this took. Called between two passes.

        A failure to write does not end the render. One line tells the first failure.
        """
        start = time.perf_counter()
        if start < self._due:
            return 0.0
        try:
            _write(self.path, self._about, result)
            self.samples, self._failed = result.taken, False
        except InputError as error:
            if not self._failed:
                tell(f"{error}: the render goes on without a checkpoint")
            self._failed = True
        end = time.perf_counter()
        self._due = end + max(self._every, SHARE * (end - start))
        return end - start

    def remove(self) -> None:
        """Remove the file, once the run is saved."""
        with suppress(OSError):  # the file then stays, and does no harm
            self.path.unlink(missing_ok=True)


def in_folder(folder: Path, suffix: str = "", judged_by: str = "") -> Checkpoint:
    """The checkpoint of a run in its folder. `suffix` tells the runs of one folder apart."""
    return Checkpoint(folder / f"checkpoint{suffix}.npz", judged_by)


def in_cache(scene: SceneData, settings: Render) -> Checkpoint | None:
    """The checkpoint, in the cache, of a render without a folder of its own; None if there is no cache.

    Removes checkpoints older than KEPT_DAYS from the cache, and all but the newest KEPT.
    """
    folder = caches.folder("checkpoints")
    if not folder:
        return None
    with suppress(OSError):  # another process may remove the same files
        files = sorted((path.stat().st_mtime, path) for path in folder.iterdir())
        for k, (written, path) in enumerate(reversed(files)):
            if k >= KEPT or written < time.time() - KEPT_DAYS * 86400:
                path.unlink()
    made_of = {name: value for name, value in about(scene, settings).items() if name != "program"}
    return Checkpoint(folder / f"{hashlib.sha256(json.dumps(made_of).encode()).hexdigest()[:24]}.npz", dispensable=True)


def about(scene: SceneData, settings: Render) -> dict[str, Any]:
    """Everything that decides the bits of a render."""
    return {"scene": scene.key, "settings": to_dict(settings), "program": program()}


@cache
def program() -> str:
    """SHA-256 of the program: its own files, the packages that it computes with, and the processor it is compiled for."""
    versions = [__version__, *(f"{name} {metadata.version(name)}" for name in _DECIDING)]
    context: Any = cpu_target.target_context
    found = hashlib.sha256(repr((versions, context.codegen().magic_tuple())).encode())
    for file in sorted(Path(__file__).parents[1].rglob("*")):
        if file.suffix in (".py", ".npz"):
            found.update(file.read_bytes())
    return found.hexdigest()


def _write(path: Path, about: dict[str, Any], result: Result) -> None:
    """Write the file under another name, then rename it. Film and guide give their arrays without copies, so this takes little memory."""
    arrays = below("film", result.film.state()) | below("guide", result.guide.state()) | {"losses": np.array(result.losses, np.float64)}
    digests = {name: digest(array) for name, array in arrays.items()}
    numbers = {name: getattr(result, name) for name in _NUMBERS}
    text = json.dumps({"about": about, "digests": digests, **numbers, "curve": result.curve})
    said = {"header": np.array(text), "sha256": np.array(_digest(text))}
    with atomic(path) as part, part.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays, **said)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _header(file: Archive) -> _Header:
    text = file.text("header")
    if file.text("sha256") != _digest(text):
        raise ValueError("the header is not what was written")
    return read(_Header, parse(text), "header")


def _restored(header: _Header, file: Archive, result: Result, settings: Render) -> Result:
    """Put the state in the file into `result`, the beginning of a render. ValueError if this render cannot have that state."""
    saved = Saved(file, header.digests)
    result.film.restore(saved.below("film"), settings.spp - 1)
    result.guide.restore(saved.below("guide"))
    result.losses = saved.array("losses", np.float64, None).tolist()
    result.curve = [*header.curve]
    if not result.curve or not all({"samples", "seconds"} <= entry.keys() for entry in result.curve):
        raise MalformedError("the curve has no passes, or some without samples or seconds")
    counts = result.film.counts
    even = settings.noise or counts.min() == counts.max() == header.taken
    if not (even and counts.max() <= header.taken == result.curve[-1]["samples"] < settings.spp):
        raise MalformedError(
            f"{header.taken} samples, but the curve has {result.curve[-1]['samples']} and pixels {counts.min()} to {counts.max()}"
        )
    for name in _NUMBERS:
        setattr(result, name, getattr(header, name))
    return result
