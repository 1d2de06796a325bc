"""A run's folder: image.exr and result.json, written last so that a folder with a result is a finished run."""

import json
import platform
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import __version__
from ..errors import atomic
from ..images import read_exr, write_exr, write_layers
from ..metrics import compare, mape_display, relmse
from ..render import Result
from ..scene.data import SceneData
from ..schema import to_dict
from ..settings import Machine, Render, recorded

RENDERED = "rendered"  # the key of references that are rendered here: they only get better
ON_THE_WAY = (mape_display, relmse)  # the measures that each pass is judged by


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
) -> None:
    """Write a run. `metrics` and the key `judged_by` are None where there is no reference, `probe` where nothing was learnt
    (see `probe.described`).

    InputError where the folder cannot be written.
    """
    described = to_dict(settings)
    header = {
        "settings": json.dumps(described),
        "scene_key": scene.key,
        "scene": scene.name,
        "program": f"blender_rl_guiding {__version__}",
    }
    _write_images(folder, result, settings, header)
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
    _write_json(folder / "result.json", values)


def _write_images(folder: Path, result: Result, settings: Render, header: dict[str, str]) -> None:
    film, layers = result.film, result.film.layers()
    if not layers:
        write_exr(folder / "image.exr", result.image, header)
        return
    combined = np.dstack([result.image, film.alpha()])
    write_exr(folder / "image.exr", combined, header)
    if settings.passes:
        write_layers(folder / "passes.exr", {"Combined": combined} | layers, header)
    del combined, layers  # memory that the denoiser can use: a gigabyte at 3840 x 2160
    if settings.denoise:
        from ..render.denoise import denoised

        write_exr(folder / "denoised.exr", denoised(film), header)


def is_done(folder: Path, scene: SceneData, settings: Render) -> bool:
    """Whether the folder holds the finished run of just these settings, scene and program version."""
    try:
        values = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    expected = (scene.key, to_dict(settings), True, __version__)
    version = values.get("versions", {}).get("blender_rl_guiding")
    return (values.get("scene_key"), recorded(values.get("settings") or {}), values.get("finished"), version) == expected


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
