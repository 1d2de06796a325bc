"""Runs experiments: scenes x methods x seeds, each run in its own folder. Finished runs are skipped."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ..comparison import Comparison
from ..errors import InputError, atomic, check_inside
from ..images import sha256, write_exr
from ..notices import tell
from ..pace import Pace
from ..render.beforehand import forewarn
from ..render.checkpoint import in_folder
from ..report import result_file
from ..report.result_file import Record
from ..scene.data import SceneData
from ..settings import BSDF, MOST_RUNS, Machine
from ..strings import fault_of_name, printable
from .forecast import Forecast
from .pool import Outcome, perform_all
from .probe import Point, pixel_of
from .produce import compile_kernels
from .progress import Progress
from .references import Given, read_given, reference
from .runs import RENDERED, Judge, Task, finished_run, judged_again
from .truth import kept


@dataclass(frozen=True)
class Experiment:
    """A comparison on some scenes, and the folder for its runs."""

    folder: Path
    scenes: tuple[SceneData, ...]
    comparison: Comparison
    command: str  # how it was started, for the report
    name: str = ""  # its name in the catalogue; empty if it is not in the catalogue
    cycles: Given | None = None  # the reference by Cycles, if the comparison uses one

    @property
    def given(self) -> Given | None:
        """The reference from a file or from Cycles; None if this renderer makes it. InputError if the reference by Cycles is missing."""
        file = self.comparison.reference_file
        if self.comparison.reference == "FILE":
            return Given(file, printable(file.name))
        if self.comparison.reference == "CYCLES" and not self.cycles:
            raise InputError("a reference by Cycles is made in Blender alone: compare there, or choose another reference")
        return self.cycles


def run(experiments: Sequence[Experiment], machine: Machine, jobs: int, progress: Progress) -> int:
    """Bring the experiments' folders up to date, `jobs` runs at a time; returns how many runs failed.

    Each failure gives one line. After an interrupt the folders keep every finished run, and the next call continues.
    """
    for experiment in experiments:
        _describe(experiment)
    asked = [task for experiment in experiments for task in _tasks(experiment)]
    finished = {task.folder: record for task in asked if (record := _finished(task))}
    if unfinished := [task for task in asked if task.folder not in finished]:
        _prepare(experiments, unfinished, machine, jobs, progress)
    due: list[Task] = []
    for experiment in experiments:
        due += _due(experiment, finished, machine, progress)
    if due and not unfinished:  # the image of a finished run could not be judged
        _prepare(experiments, asked, machine, jobs, progress)
    return _perform(due, machine, jobs, progress)


def _perform(due: Sequence[Task], machine: Machine, jobs: int, progress: Progress) -> int:
    forecast, failed = Forecast(due, jobs), 0
    with progress("runs", forecast.total) as advance:

        def on_pace(task: Task, pace: Pace) -> None:
            forecast.go(task, pace)
            advance(forecast.done, total=forecast.total, description=task.label)

        def on_end(task: Task, outcome: Outcome) -> None:
            nonlocal failed
            forecast.end(task, outcome)
            text = outcome.text
            if outcome.seconds is None:
                failed += 1
                text = f"FAILED: {text}"
            tell(f"{task.label}: {text} ({forecast})")

        perform_all(due, machine, jobs, on_pace, on_end)
    return failed


def _tasks(experiment: Experiment) -> Iterator[Task]:
    """All runs, without reference and probe. All methods do one seed before the next seed begins, so that an early report is fair."""
    for scene in experiment.scenes:
        for seed in experiment.comparison.all_seeds():
            for name, method in experiment.comparison.compared().items():
                folder = experiment.folder / scene.name / name / f"seed-{seed}"
                yield Task(folder, scene, replace(method, seed=seed), name, forewarned=True)


def _finished(task: Task) -> Record | None:
    """The record of a finished run. None if there is no record, or if the run is damaged. A line names the damage."""
    assert task.folder
    try:
        return finished_run(task.folder, task.scene, task.settings)
    except InputError as error:
        tell(f"{error}; the run is made again")
        return None


def _due(experiment: Experiment, finished: Mapping[Path | None, Record], machine: Machine, progress: Progress) -> list[Task]:
    """The unfinished runs. The errors of finished runs are measured again with the current reference."""
    judges = {scene.name: _reference(scene, experiment, machine, progress) for scene in experiment.scenes}
    probes = {scene.name: _probe(scene, experiment, machine, progress) for scene in experiment.scenes}
    due = []
    for task in _tasks(experiment):
        judge, record = judges[task.scene.name], finished.get(task.folder)
        if not record or not _is_kept(task, record, judge):
            due.append(replace(task, judge=judge, probe=probes[task.scene.name]))
    return due


def _is_kept(task: Task, record: Record, judge: Judge) -> bool:
    """Judge a finished run again. If its image cannot be judged: False, and a line says why."""
    assert task.folder
    in_folder(task.folder).remove()  # a checkpoint remains if the program was killed just after it wrote the result
    try:
        anew = judged_again(task.folder, record, judge)
    except InputError as error:
        tell(f"{task.label}: {error}; the run is made again")
        return False
    if anew != record:
        result_file.write(task.folder / "result.json", anew)
    tell(f"{task.label}: done before", again=True)
    return True


def _prepare(experiments: Sequence[Experiment], due: Sequence[Task], machine: Machine, jobs: int, progress: Progress) -> None:
    """Check the memory need of the due runs (`forewarn`). Compile all code before anything is timed, and before child processes start."""
    for experiment in experiments:
        for scene in experiment.scenes:
            if own := [task for task in due if task.scene is scene]:
                forewarn(scene, list({task.method: task.settings for task in own}.values()), machine, min(jobs, len(own)))
    methods = (settings for experiment in experiments for _, settings in experiment.comparison.methods)
    guides = {type(settings.guide): settings.guide for settings in methods}
    compile_kernels([BSDF(), *guides.values()], machine, progress)


def _describe(experiment: Experiment) -> None:
    """Write experiment.json. InputError if the experiment is not possible."""
    _check(experiment)
    asked, given = experiment.comparison, experiment.given
    names = [name for name, _ in asked.methods]
    plan = {
        "name": experiment.name,
        "scenes": [scene.name for scene in experiment.scenes],
        "methods": names,
        "seeds": list(asked.all_seeds()),
        "baseline": names[0],
        "command": experiment.command,
        "reference": given.about if given else f"{asked.reference_spp} samples per pixel or more",
    }
    with atomic(experiment.folder / "experiment.json") as part:
        part.write_text(json.dumps(plan, indent=1), encoding="utf-8")


def _check(experiment: Experiment) -> None:
    """InputError if the comparison is not possible with these scenes or in this folder."""
    names = [scene.name for scene in experiment.scenes]
    asked, given = experiment.comparison, experiment.given
    if (count := len(names) * len(asked.methods) * asked.seeds) > MOST_RUNS:
        raise InputError(f"{experiment.folder}: an experiment of {count} runs; {MOST_RUNS} are the most")
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two scenes are called {name!r}: their results would share a folder")
        if fault := fault_of_name(name):
            raise InputError(f"{name!r} {fault}")
    if given and len(names) > 1:
        raise InputError(f"{given.path} cannot be the reference of {len(names)} scenes")
    _check_folder(experiment)
    for scene in experiment.scenes:
        pixel_of(scene, asked.pixel())
        if given:
            read_given(given, scene)


def _check_folder(experiment: Experiment) -> None:
    """InputError if a file of the experiment would lie outside of its folder."""
    folders = [task.folder for task in _tasks(experiment) if task.folder]
    beside = [experiment.folder / scene.name / file for scene in experiment.scenes for file in ("reference.exr", "probe.json")]
    for path in (*folders, *beside, experiment.folder / "experiment.json"):
        check_inside(experiment.folder, path)


def _reference(scene: SceneData, experiment: Experiment, machine: Machine, progress: Progress) -> Judge:
    """The reference for the scene's runs. Its image is written into the scene's folder."""
    path = experiment.folder / scene.name / "reference.exr"
    if given := experiment.given:
        truth, digest = read_given(given, scene)
        write_exr(path, truth, {"scene_key": scene.key, "sha256": digest, "about": given.about})
        return Judge(truth, digest)
    spp = experiment.comparison.reference_spp
    tell(f"{scene.name}: reference of {spp} samples per pixel, kept for the next time", again=True)
    with progress(f"{scene.name}: reference", 1) as advance:
        truth = reference(scene, experiment.comparison.max_bounces(), spp, machine, advance)
    write_exr(path, truth, {"scene_key": scene.key, "sha256": sha256(truth), "spp": str(spp)})
    return Judge(truth, RENDERED)


def _probe(scene: SceneData, experiment: Experiment, machine: Machine, progress: Progress) -> Point | None:
    """The point at which Q is reported, if any method learns. The truth at this point is written into the scene's folder."""
    asked = experiment.comparison
    if not asked.use_probe or not any(settings.guide.learns for _, settings in asked.methods):
        return None
    pixel, path = pixel_of(scene, asked.pixel()), experiment.folder / scene.name / "probe.json"
    with progress(f"{scene.name}: radiance that arrives at pixel {pixel}", 1):
        point = kept(path, scene, pixel, asked.max_bounces(), machine)
    if point is None:
        tell(f"{scene.name}: pixel {pixel} sees no surface that reflects: no picture of what is learnt; --probe X Y names another")
    return point
