"""A run's folder: image.exr, image.png and result.json, written last so that a folder with a result is a finished run."""

import json
import platform
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import __version__
from ..errors import atomic
from ..images import read_exr, write_exr, write_layers, write_png
from ..metrics import compare, mape_display, relmse
from ..render import Result
from ..scene.data import SceneData
from ..schema import to_dict
from ..settings import Machine, Render, recorded

RENDERED = "rendered"  # the key of references that are rendered here: they only get better
ON_THE_WAY = (mape_display, relmse)  # the measures that each pass is judged by


class Frame(NamedTuple):
    """One of an animation: its files have numbers, and lie in one folder."""

    number: int
    source: str  # what it was made of, see `scene.frames`

    @property
    def suffix(self) -> str:
        """What Blender appends to the names of its frames."""
        return f"-{self.number:04}"


class Judge(NamedTuple):
    """What runs are judged by."""

    truth: np.ndarray  # the reference image
    key: str  # what tells it from another: the SHA-256 of its pixels, or `RENDERED`


def save_run(
    folder: Path,
    scene: SceneData,
    method: str,
    settings: Render,
    machine: Machine,
    result: Result,
    metrics: dict[str, float] | None,
    probe: dict[str, Any] | None = None,
    judged_by: str | None = None,
    frame: Frame | None = None,
) -> None:
    """Write a run, or a frame of an animation. `metrics` and the key `judged_by` are None where there is no reference, `probe` where
    nothing was learnt (see `probe.described`).

    InputError where the folder cannot be written.
    """
    described = to_dict(settings)
    header = {
        "settings": json.dumps(described),
        "scene_key": scene.key,
        "scene": scene.name,
        "program": f"blender_rl_guiding {__version__}",
    }
    suffix = frame.suffix if frame else ""
    told = folder / f"result{suffix}.json"
    with suppress(OSError):  # which the images meet with as well, and report
        told.unlink(missing_ok=True)  # or it would tell of an image that it was not written for, if this is interrupted
    _write_images(folder, suffix, result, settings, header)
    values: dict[str, Any] = {
        "scene": scene.name,
        "scene_key": scene.key,
        "method": method,
        "seed": settings.seed,
        "spp": result.film.samples,
        "finished": result.finished,
        "resolution": [scene.camera.width, scene.camera.height],
        "seconds": result.seconds,
        "learn_seconds": result.learn_seconds,
        "rays": result.rays,
        "metrics": metrics,
        "judged_by": judged_by,
        "settings": described,
        "machine": to_dict(machine) | {"system": platform.platform(), "processor": platform.machine()},
        "versions": _versions(),
        "curve": result.curve,
        "losses": [float(f"{loss:.5g}") for loss in result.losses],
        "probe": probe,
    }
    _write_json(told, values | {"frame": frame.number, "source": frame.source} if frame else values)


def _write_images(folder: Path, suffix: str, result: Result, settings: Render, header: dict[str, str]) -> None:
    film, layers = result.film, result.film.layers()
    if not layers:
        _write_image(folder / f"image{suffix}", result.image, header)
        return
    combined = np.dstack([result.image, film.alpha()])
    _write_image(folder / f"image{suffix}", combined, header)
    if settings.passes:
        write_layers(folder / f"passes{suffix}.exr", {"Combined": combined} | layers, header)
    del combined, layers  # memory that the denoiser can use: a gigabyte at 3840 x 2160
    if settings.denoise:
        from ..render.denoise import denoised

        _write_image(folder / f"denoised{suffix}", denoised(film), header)


def _write_image(name: Path, pixels: np.ndarray, header: dict[str, str]) -> None:
    """An image twice: its numbers, and what an eye sees of it."""
    write_exr(name.with_name(f"{name.name}.exr"), pixels, header)
    write_png(name.with_name(f"{name.name}.png"), pixels)


def is_done(folder: Path, scene: SceneData, settings: Render) -> bool:
    """Whether the folder holds the finished run of just these settings, scene and program version."""
    return _tells(folder / "result.json", settings, scene_key=scene.key)


def frame_is_done(folder: Path, frame: Frame, settings: Render) -> bool:
    """The same of a frame of an animation, by what it was made of."""
    there = (folder / f"image{frame.suffix}.exr").is_file()
    return there and _tells(folder / f"result{frame.suffix}.json", settings, source=frame.source)


def _tells(path: Path, settings: Render, **made_of: str) -> bool:
    """Whether a result.json is there and tells of a finished run with these settings, by this version of the program."""
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    version = values.get("versions", {}).get("blender_rl_guiding")
    expected = {"finished": True, **made_of}
    same = recorded(values.get("settings") or {}) == to_dict(settings)
    return version == __version__ and same and all(values.get(name) == value for name, value in expected.items())


def judge_again(folder: Path, judge: Judge) -> None:
    """Bring a finished run's metrics up to date: the reference may have got better since, or be another.

    Its curve's errors stay as they were judged by a lesser reference, but not by another: there is no image any more to judge.
    """
    path = folder / "result.json"
    values = json.loads(path.read_text(encoding="utf-8"))
    curve, metrics = values["curve"], compare(read_exr(folder / "image.exr")[0], judge.truth)
    if values.get("judged_by", RENDERED) != judge.key:
        judged = {measure.__name__ for measure in ON_THE_WAY}
        curve = [{name: value for name, value in entry.items() if name not in judged} for entry in curve]
    anew = values | {"metrics": metrics, "judged_by": judge.key, "curve": curve}
    if anew != values:
        _write_json(path, anew)


def _write_json(path: Path, values: dict[str, Any]) -> None:
    with atomic(path) as part:
        part.write_text(json.dumps(values, indent=1), encoding="utf-8")


def _versions() -> dict[str, str]:
    packages = ("numpy", "torch", "embreex", "numba")
    return {"blender_rl_guiding": __version__, "python": platform.python_version()} | {name: metadata.version(name) for name in packages}
