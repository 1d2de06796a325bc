"""Runs an experiment: scenes x methods x seeds, each run in a folder of its own; what is done already is skipped."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..errors import InputError, atomic
from ..images import write_exr
from ..metrics import compare
from ..render import render, warm_up
from ..scene.data import SceneData
from ..settings import BSDF, Machine, Render
from .progress import Progress
from .references import reference
from .runs import is_done, judge_again, save_run


@dataclass(frozen=True)
class Experiment:
    """What is compared; the first method is the baseline."""

    scenes: tuple[SceneData, ...]
    methods: dict[str, Render]  # by name
    seeds: tuple[int, ...]
    reference_spp: int
    command: str  # how it was started, for the report


def run(experiment: Experiment, folder: Path, machine: Machine, progress: Progress) -> None:
    """Bring the experiment's folder up to date. Interrupted, it keeps every finished run, and the next call goes on from there."""
    _describe(experiment, folder)
    if not all(is_done(place, scene, settings) for scene in experiment.scenes for _, place, settings in _tasks(experiment, scene, folder)):
        compile_kernels(experiment, machine, progress)
    total = len(experiment.scenes) * len(experiment.seeds) * len(experiment.methods)
    with progress.bar("runs", total) as advance:
        done = 0
        for scene in experiment.scenes:
            truth = _reference(scene, experiment, folder, machine, progress)
            for name, place, settings in _tasks(experiment, scene, folder):
                _run(place, scene, name, settings, truth, machine, progress)
                advance(done := done + 1)


def _tasks(experiment: Experiment, scene: SceneData, folder: Path) -> Iterator[tuple[str, Path, Render]]:
    """Method, folder and settings of each run; a seed is done by all methods before the next, so that an early report is fair."""
    for seed in experiment.seeds:
        for name, method in experiment.methods.items():
            settings = replace(method, seed=seed)
            yield name, folder / scene.name / name / f"seed-{seed}", settings


def compile_kernels(experiment: Experiment, machine: Machine, progress: Progress) -> None:
    """Have all code compiled before anything is timed."""
    guides = {type(settings.guide): settings.guide for settings in experiment.methods.values()}
    with progress.bar("compiling kernels (once after an update)", len(guides) + 1) as advance:
        for done, guide in enumerate([BSDF(), *guides.values()]):
            warm_up(guide, machine)
            advance(done + 1)


def _describe(experiment: Experiment, folder: Path) -> None:
    names = [scene.name for scene in experiment.scenes]
    if doubles := {name for name in names if names.count(name) > 1}:
        raise InputError(f"two scenes are called {min(doubles)!r}: their results would share a folder")
    plan = {
        "scenes": names,
        "methods": list(experiment.methods),
        "seeds": list(experiment.seeds),
        "baseline": next(iter(experiment.methods)),
        "command": experiment.command,
    }
    with atomic(folder / "experiment.json") as part:
        part.write_text(json.dumps(plan, indent=1), encoding="utf-8")


def _reference(scene: SceneData, experiment: Experiment, folder: Path, machine: Machine, progress: Progress) -> np.ndarray:
    bounces = {settings.max_bounces for settings in experiment.methods.values()}
    if len(bounces) > 1:
        raise InputError(f"the methods trace paths of different lengths ({sorted(bounces)} bounces): they have no common reference")
    progress.note(f"{scene.name}: reference of {experiment.reference_spp} samples per pixel, kept for the next time")
    with progress.bar(f"{scene.name}: reference", 1) as advance:
        truth = reference(scene, bounces.pop(), experiment.reference_spp, machine, advance)
    write_exr(folder / scene.name / "reference.exr", truth, {"scene_key": scene.key, "spp": str(experiment.reference_spp)})
    return truth


def _run(folder: Path, scene: SceneData, name: str, settings: Render, truth: np.ndarray, machine: Machine, progress: Progress) -> None:
    label = f"{scene.name} {name} seed {settings.seed}"
    if is_done(folder, scene, settings):
        judge_again(folder, truth)
        progress.note(f"{label}: done before")
        return
    with progress.bar(label, settings.spp) as advance:
        result = render(scene, settings, machine, lambda state: advance(state.film.samples))
    metrics = compare(result.image, truth)
    save_run(folder, scene, name, settings, machine, result, metrics)
    progress.note(f"{label}: {result.seconds:.1f} s, mape_display {metrics['mape_display']:.4f}")
