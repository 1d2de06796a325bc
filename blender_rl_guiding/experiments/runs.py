"""A run's folder: image.exr, image.png and result.json. result.json is written last, so a folder with result.json is a finished run."""

import hashlib
import json
import platform
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import __version__, typed
from ..errors import InputError, check_inside, trying_to
from ..images import read_exr, write_exr, write_layers, write_png
from ..images.metrics import compare, mape_display, relmse
from ..render import Result
from ..report import result_file
from ..report.result_file import Learnt, Record
from ..scene.data import SceneData
from ..schema import to_dict
from ..settings import Machine, Render, recorded
from .probe import Point

RENDERED = "rendered"  # the key of every reference by this renderer; a later reference only has more samples
ON_THE_WAY = (mape_display, relmse)  # the measures of each pass


class Frame(NamedTuple):
    """A frame of an animation. The files of all frames have numbers and lie in one folder."""

    number: int
    source: str  # the key of its file and view, see `opening.frames`

    @property
    def suffix(self) -> str:
        """The suffix that Blender appends to the names of frames."""
        return f"-{self.number:04}"


class Judge(NamedTuple):
    """The reference of a scene's runs."""

    truth: np.ndarray  # the image, (H, W, 3) float32
    key: str  # the SHA-256 of its pixels, or `RENDERED`


@dataclass(frozen=True, eq=False)
class Task:
    """A run to do. It can be pickled."""

    folder: Path | None  # with None nothing is saved
    scene: SceneData
    settings: Render
    method: str = ""  # its name in the results; if empty, the guide's name
    judge: Judge | None = None
    probe: Point | None = None  # the point at which the guide's Q is saved
    frame: Frame | None = None  # the frame, if the run is a frame of an animation
    forewarned: bool = False  # whether the caller has already called `forewarn` for several runs at once
    keeps_unfinished: bool = False  # whether Ctrl-C saves the image of the finished samples

    @property
    def label(self) -> str:
        """The name of the run in messages."""
        return f"{self.scene.name} {self.method} seed {self.settings.seed}"

    @property
    def suffix(self) -> str:
        """The suffix of the names of its files."""
        return self.frame.suffix if self.frame else ""


def save_run(
    task: Task, machine: Machine, result: Result, metrics: dict[str, float] | None = None, learnt: dict[str, Any] | None = None
) -> None:
    """Write a run, or a frame of an animation. A run without a folder is not written. InputError if the folder cannot be written.

    metrics: errors against the reference, if there is one.
    learnt: see `probe.described`.
    """
    scene, settings, folder = task.scene, to_dict(task.settings), task.folder
    if not folder:
        return
    header = {
        "settings": json.dumps(settings),
        "scene_key": scene.key,
        "scene": scene.name,
        "program": f"blender_rl_guiding {__version__}",
    }
    told = folder / f"result{task.suffix}.json"
    with suppress(OSError):  # writing the images fails with the same error, and reports it
        told.unlink(missing_ok=True)  # first: after an interrupt, no result.json of another image may remain
    images = _write_images(folder, task.suffix, result, task.settings, header)
    record = Record(
        scene=scene.name,
        scene_key=scene.key,
        method=task.method or task.settings.guide.kind,
        seed=task.settings.seed,
        spp=result.film.samples,
        finished=result.finished,
        resolution=(scene.camera.width, scene.camera.height),
        seconds=result.seconds,
        learn_seconds=result.learn_seconds,
        rays=result.rays,
        metrics=metrics,
        judged_by=task.judge.key if task.judge else None,
        settings=settings,
        machine=to_dict(machine) | {"system": platform.platform(), "processor": platform.machine()},
        versions=versions(),
        curve=tuple(result.curve),
        losses=tuple(float(f"{loss:.5g}") for loss in result.losses),
        probe=Learnt(**learnt) if learnt else None,
        images={path.name: _sha256(path) for path in images},
        frame=task.frame.number if task.frame else None,
        source=task.frame.source if task.frame else None,
    )
    result_file.write(told, record)


def _names(suffix: str) -> tuple[str, str, str]:
    """The names of a run's EXR files: the image, its passes, and the denoised image."""
    return f"image{suffix}.exr", f"passes{suffix}.exr", f"denoised{suffix}.exr"


def _write_images(folder: Path, suffix: str, result: Result, settings: Render, header: dict[str, str]) -> list[Path]:
    """Write the images; returns the EXR files."""
    film, layers = result.film, result.film.layers()
    image, passes, clean = (folder / name for name in _names(suffix))
    if not layers:
        _write_image(image, result.image, header)
        return [image]
    written, combined = [image], np.dstack([result.image, film.alpha()])
    _write_image(image, combined, header)
    if settings.passes:
        written.append(passes)
        write_layers(passes, {"Combined": combined} | layers, header)
    del combined, layers  # freed for the denoiser: a gigabyte at 3840 x 2160
    if settings.denoise:
        from ..render.denoise import denoised

        written.append(clean)
        _write_image(clean, denoised(film), header)
    return written


def _write_image(path: Path, pixels: np.ndarray, header: dict[str, str]) -> None:
    """Write an image twice: linear values as EXR, and a PNG for viewing."""
    write_exr(path, pixels, header)
    write_png(path.with_suffix(".png"), pixels)


def finished_run(folder: Path, scene: SceneData, settings: Render) -> Record | None:
    """The finished run in a folder. None if there is none, or if its scene, settings or version differ.

    InputError if it is damaged, or if an image differs from the image that was written with it.
    """
    return _finished(folder, "", settings, scene_key=scene.key)


def finished_frame(folder: Path, frame: Frame, settings: Render) -> Record | None:
    """The finished run of a frame of an animation. The frame's source replaces the key of the scene."""
    return _finished(folder, frame.suffix, settings, source=frame.source)


def _finished(folder: Path, suffix: str, settings: Render, **made_of: str) -> Record | None:
    path = folder / f"result{suffix}.json"
    if not path.exists():
        return None
    record = result_file.read(path)
    same = record.versions.get("blender_rl_guiding") == __version__ and recorded(record.settings) == to_dict(settings)
    if not (record.finished and same and all(getattr(record, name) == value for name, value in made_of.items())):
        return None
    names = _names(suffix)
    if not record.sha256 or names[0] not in record.images:
        raise InputError(f"{path} does not say what {names[0]} has to be: it is of an earlier version")
    for name, digest in record.images.items():
        if name not in names:  # a stranger's result.json can have a valid checksum and any path
            raise InputError(f"{path} names {name!r}, which is no image of a run")
        if _sha256(folder / name) != digest:
            raise InputError(f"{folder / name} is not the image that belongs to {path.name}")
    return record


def _sha256(path: Path) -> str:
    """The checksum of a file inside its folder. A checksum of the pixels would take far longer, because the pixels are compressed."""
    check_inside(path.parent, path)
    with trying_to(f"read {path}"), typed.opened(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def judged_again(folder: Path, record: Record, judge: Judge) -> Record:
    """A finished run with its metrics against the current reference.

    If the reference only gained samples, the errors of the curve stay. If the reference is another image, these errors are dropped.
    InputError if the run's image cannot be read, or has another size.
    """
    curve, metrics = record.curve, compare(read_exr(folder / "image.exr")[0], judge.truth)
    if (record.judged_by or RENDERED) != judge.key:
        judged = {measure.__name__ for measure in ON_THE_WAY}
        curve = tuple({name: value for name, value in entry.items() if name not in judged} for entry in curve)
    return replace(record, metrics=metrics, judged_by=judge.key, curve=curve)


def versions() -> dict[str, str]:
    """The versions of this program, of Python, and of the libraries that pixels depend on."""
    packages = ("numpy", "torch", "embreex", "numba")
    return {"blender_rl_guiding": __version__, "python": platform.python_version()} | {name: metadata.version(name) for name in packages}
