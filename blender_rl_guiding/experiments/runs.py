"""A run's folder: image.exr, image.png and result.json, written last so that a folder with a result is a finished run."""

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

RENDERED = "rendered"  # the key of references that are rendered here: they only get better
ON_THE_WAY = (mape_display, relmse)  # the measures that each pass is judged by


class Frame(NamedTuple):
    """One of an animation: its files have numbers, and lie in one folder."""

    number: int
    source: str  # the key of the file and view that it was made of, see `opening.frames`

    @property
    def suffix(self) -> str:
        """What Blender appends to the names of its frames."""
        return f"-{self.number:04}"


class Judge(NamedTuple):
    """The reference of a scene's runs."""

    truth: np.ndarray  # the image, (H, W, 3) float32
    key: str  # the SHA-256 of its pixels, or `RENDERED`


@dataclass(frozen=True, eq=False)
class Task:
    """A run to be made. It can be pickled."""

    folder: Path | None  # None saves nothing
    scene: SceneData
    settings: Render
    method: str = ""  # its name in the results; empty for the guide's
    judge: Judge | None = None
    probe: Point | None = None  # where the guide is asked what it has learnt
    frame: Frame | None = None  # of an animation
    forewarned: bool = False  # whether the caller has called `forewarn`, for several runs at once
    keeps_unfinished: bool = False  # whether the finished samples are saved where Ctrl-C ends it

    @property
    def label(self) -> str:
        """The run's name for people."""
        return f"{self.scene.name} {self.method} seed {self.settings.seed}"

    @property
    def suffix(self) -> str:
        """What the names of its files end with."""
        return self.frame.suffix if self.frame else ""


def save_run(
    task: Task, machine: Machine, result: Result, metrics: dict[str, float] | None = None, learnt: dict[str, Any] | None = None
) -> None:
    """Write a run, or a frame of an animation; nothing of one without a folder. InputError where the folder cannot be written.

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
    with suppress(OSError):  # which the images meet with as well, and report
        told.unlink(missing_ok=True)  # an interrupt here must not leave the record of another image
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
    """The names of a run's EXR files: the image, its passes, and without noise."""
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
    del combined, layers  # memory that the denoiser can use: a gigabyte at 3840 x 2160
    if settings.denoise:
        from ..render.denoise import denoised

        written.append(clean)
        _write_image(clean, denoised(film), header)
    return written


def _write_image(path: Path, pixels: np.ndarray, header: dict[str, str]) -> None:
    """Write an image twice: its numbers as EXR, and a PNG for the eye."""
    write_exr(path, pixels, header)
    write_png(path.with_suffix(".png"), pixels)


def finished_run(folder: Path, scene: SceneData, settings: Render) -> Record | None:
    """The finished run in a folder; None where there is none, or one of another scene, other settings or another version.

    InputError where it is damaged, or an image is not the one that was written with it.
    """
    return _finished(folder, "", settings, scene_key=scene.key)


def finished_frame(folder: Path, frame: Frame, settings: Render) -> Record | None:
    """The same for a frame of an animation; its source stands for the scene."""
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
        if name not in names:  # anyone can seal a record of any path
            raise InputError(f"{path} names {name!r}, which is no image of a run")
        if _sha256(folder / name) != digest:
            raise InputError(f"{folder / name} is not the image that {path.name} is of")
    return record


def _sha256(path: Path) -> str:
    """The checksum of a file inside its folder. One of the pixels would take far longer: they are compressed."""
    check_inside(path.parent, path)
    with trying_to(f"read {path}"), typed.opened(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def judged_again(folder: Path, record: Record, judge: Judge) -> Record:
    """A finished run with its metrics against the reference as it is now.

    Keeps the curve's errors if the reference only gained samples; drops them if it is another image.
    InputError where the run's image cannot be read, or is of another size.
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
