"""Reads an experiment's folder, which may come from a stranger. Damaged runs are listed and left out; the report uses the others."""

import hashlib
import os
import re
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np

from .. import typed
from ..errors import InputError, check_inside
from ..images import read_exr
from ..measures import NAMES
from ..settings import MOST_METHODS, MOST_RUNS, recorded
from ..strings import OldName, fault_of_name, printable
from ..typed import Range
from . import result_file
from .result_file import Count, Error, Record, load_sealed
from .results import Pictures, Results, Run, Truth

SHORTEST = 1e-9  # seconds of a run: rates are per second
_T = TypeVar("_T")
_CURVE = dict.fromkeys(("samples", "mape_display", "relmse"), Range(0.0, 1e30))
_CURVE |= dict.fromkeys(("seconds", "train_seconds", "infer_seconds"), Range(0.0, 1e12))


def _no_word(text: str) -> str:
    return fault_of_name(text) or ("is too long" if len(text) > 40 else "")


_Word = Annotated[str, _no_word]  # becomes a part of a figure's name


@dataclass(frozen=True)
class _Plan:
    """experiment.json."""

    scenes: tuple[OldName, ...]
    methods: tuple[OldName, ...]
    seeds: tuple[Count, ...]
    baseline: OldName
    command: str
    name: str = ""
    reference: str = "as converged as it was asked for"


@dataclass(frozen=True)
class _Encoder:
    kind: str


@dataclass(frozen=True)
class _Guide:
    kind: _Word
    error: _Word = ""  # the kind of the loss, if the guide minimises one
    encoder: _Encoder = _Encoder("none")


@dataclass(frozen=True)
class _Settings:
    """The settings that affect the report of a run. All other settings are only displayed."""

    guide: _Guide
    nee: bool = False


def load(folder: Path) -> Results:
    """Read an experiment's folder.

    Runs without result.json are listed as missing. Damaged files and files of other runs are listed as damaged, and left out.
    InputError if experiment.json is damaged, or if no run is left.
    """
    plan = _plan(folder / "experiment.json")
    # Read only the runs in the plan: the folder may also contain runs of an earlier, larger experiment.
    places = [(scene, method, seed) for scene in plan.scenes for method in plan.methods for seed in sorted(plan.seeds)]
    runs, missing, damage = list[Run](), [], _Damage(folder)
    for scene, method, seed in places:
        if os.path.lexists(folder / scene / method / f"seed-{seed}" / "result.json"):
            runs += damage.without(_run, folder, scene, method, seed)
        else:
            missing.append(f"{scene}/{method}/seed-{seed}")
    truths = {scene: truth for scene in plan.scenes for truth in damage.without(_truth, folder, scene)}
    kept, pictures = list[Run](), dict[str, Pictures]()
    for scene in plan.scenes:
        size, found = _of_one_size([run for run in runs if run.scene == scene], damage)
        reference = damage.without(_picture, folder, folder / scene / "reference.exr", size) if found else []
        if reference:
            found, shots = _with_images(folder, found, reference[0].shape[1::-1], damage)
            pictures[scene] = Pictures(reference[0], shots)
        kept += found
    if not kept:
        raise InputError(f"{folder}: no run of the experiment is {f'whole: {damage.found[0]}' if damage.found else 'finished'}")
    told = (plan.name, plan.scenes, plan.methods, plan.baseline, plan.command, plan.reference)
    return Results(folder, *told, tuple(kept), tuple(missing), truths, tuple(damage.found), pictures)


class _Damage:
    """Collects the errors of a folder, in the order of finding."""

    def __init__(self, folder: Path) -> None:
        self.found = list[str]()
        self._inside = re.compile(f"(^|^cannot read ){re.escape(printable(f'{folder}{os.sep}'))}")

    def without(self, read: Callable[..., _T | None], *args: Any) -> list[_T]:
        """A list with the value of `read`; empty if the value is None or damaged."""
        try:
            value = read(*args)
        except InputError as error:
            self.found.append(self._inside.sub(r"\1", str(error)))
            return []
        return [] if value is None else [value]


def _plan(path: Path) -> _Plan:
    plan = load_sealed(_Plan, path, "an experiment")
    for what, names in (("scenes", plan.scenes), ("methods", plan.methods), ("seeds", plan.seeds)):
        if len(set(names)) < len(names):
            raise InputError(f"{path}: not an experiment, or damaged ({statistics.mode(names)!r} stands in {what} twice)")
    if plan.baseline not in plan.methods:
        raise InputError(f"{path}: the baseline {plan.baseline!r} is not one of the methods {', '.join(plan.methods)}")
    if (count := len(plan.methods)) > MOST_METHODS:
        raise InputError(f"{path}: not an experiment, or damaged (it has {count} methods)")
    if (count := len(plan.scenes) * len(plan.methods) * len(plan.seeds)) > MOST_RUNS:
        raise InputError(f"{path}: not an experiment, or damaged (it has {count} runs)")
    return plan


def _run(folder: Path, scene: str, method: str, seed: int) -> Run:
    place = folder / scene / method / f"seed-{seed}"
    path = place / "result.json"
    check_inside(folder, path)
    record = result_file.read(path)
    if (record.scene, record.method, record.seed) != (scene, method, seed):
        raise InputError(f"{path} is of another run: {typed.shown(f'{record.scene}/{record.method}/seed-{record.seed}')}")
    try:
        metrics = _metrics(record)
    except typed.MalformedError as error:
        raise InputError(f"{path}: not a result, or damaged ({error})") from error
    return Run(**(vars(record) | {"folder": place, "metrics": metrics, "settings": recorded(record.settings)}))


def _metrics(record: Record) -> dict[str, float]:
    """The errors of a run. MalformedError if the run cannot be reported."""
    _check_curve(record.curve)
    typed.read(_Settings, record.settings, "settings", loose=True)
    metrics = typed.read(dict[str, Error], record.metrics, "metrics")
    for name in NAMES:
        if name not in metrics:
            raise typed.MalformedError(f"metrics lacks {name!r}")
    if record.seconds < SHORTEST:
        raise typed.MalformedError(f"seconds is {record.seconds}")
    return metrics


def _check_curve(curve: Sequence[Mapping[str, float]]) -> None:
    """MalformedError if a chart cannot show an entry."""
    for k, entry in enumerate(curve):
        if missing := {"samples", "seconds"} - entry.keys():
            raise typed.MalformedError(f"curve[{k}] lacks {min(missing)!r}")
        for name, limits in _CURVE.items():
            if name in entry and not limits.low <= entry[name] <= limits.high:
                raise typed.MalformedError(f"curve[{k}].{name} is {entry[name]}, not within {limits.low} and {limits.high}")


def _truth(folder: Path, scene: str) -> Truth | None:
    path = folder / scene / "probe.json"
    if not os.path.lexists(path):
        return None
    check_inside(folder, path)
    truth = load_sealed(Truth, path, "a probe")
    rows, columns = truth.patches
    if len(truth.radiance) != rows * columns:
        raise InputError(f"{path}: not a probe, or damaged (radiance has {len(truth.radiance)} values, not {rows} x {columns})")
    return truth


# --- pictures --------------------------------------------------------------------------------------------------------


def _of_one_size(runs: list[Run], damage: _Damage) -> tuple[tuple[int, int] | None, list[Run]]:
    """The most common image size of a scene's runs, and the runs with this size. Runs of earlier versions may not record their size."""
    sizes = [run.resolution for run in runs if run.resolution]
    if not sizes:
        return None, runs
    size = statistics.mode(sizes)
    return size, [fitting for run in runs for fitting in damage.without(_fitting, run, size)]


def _fitting(run: Run, size: tuple[int, int]) -> Run:
    if run.resolution not in (None, size):
        raise InputError(f"{run.folder / 'result.json'} is of another run: {_pixels(run.resolution)}, not {_pixels(size)} as the others")
    return run


def _with_images(folder: Path, runs: list[Run], size: tuple[int, ...], damage: _Damage) -> tuple[list[Run], list[tuple[Run, np.ndarray]]]:
    """The runs to report, and the first intact image of each method. A method's runs before this image are left out, because their images
    are damaged.
    """
    whole, shots = list[Run](), list[tuple[Run, np.ndarray]]()
    for run in runs:
        if any(run.method == shown.method for shown, _ in shots):
            whole.append(run)
            continue
        for image in damage.without(_image, folder, run, size):
            whole.append(run)
            shots.append((run, image))
    return whole, shots


def _image(folder: Path, run: Run, size: tuple[int, ...]) -> np.ndarray:
    path = run.folder / "image.exr"
    image = _picture(folder, path, size)
    if (digest := run.images.get("image.exr")) and hashlib.sha256(path.read_bytes()).hexdigest() != digest:
        raise InputError(f"{path} is not the image that was written with its result.json")
    return image


def _picture(folder: Path, path: Path, size: tuple[int, ...] | None) -> np.ndarray:
    check_inside(folder, path)
    image, _ = read_exr(path)
    height, width, _ = image.shape
    if size and (width, height) != size:
        raise InputError(f"{path} is {_pixels((width, height))}, not {_pixels(size)} as the others")
    if not np.isfinite(image).all():
        raise InputError(f"{path} has pixels that are not finite numbers")
    return image


def _pixels(size: tuple[int, ...]) -> str:
    return f"{size[0]} x {size[1]} pixels"
