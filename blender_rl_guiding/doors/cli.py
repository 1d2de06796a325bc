"""The command `rlg`: export, render, inspect, compare, sweep, report, metrics."""

import argparse
import json
import os
import shlex
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

from rich.console import Console

from ..catalogue import CATALOGUE, Entry, chosen
from ..comparison import Comparison
from ..errors import InputError
from ..experiments.progress import Progress, terminal
from ..flags import comparison, comparison_of_methods, failed_runs, machine_of, render_settings, tell_losses
from ..locks import writing
from ..notices import tell
from ..scene.view import chosen_view
from ..settings import Render
from ..strings import say
from .parser import SEEDS, parser

INTERRUPTED = 130  # the usual exit status after Ctrl-C


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status. Bad input gives one line on stderr and status 2."""
    for name in (signal.SIGINT, signal.SIGTERM):  # also SIGINT, because shells start background jobs with SIGINT ignored
        signal.signal(name, signal.default_int_handler)
    options = parser(COMMANDS).parse_args(arguments)
    try:
        options.command(options)
    except (InputError, FloatingPointError) as error:
        say(f"rlg: {error}", sys.stderr)
        return 2
    except KeyboardInterrupt as interrupt:
        _leave(str(interrupt) or "interrupted")
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # otherwise the interpreter prints an error again at exit
    except OSError as error:  # from a place without its own check
        say(f"rlg: {error}", sys.stderr)
        return 2
    return 0


def _leave(reason: str) -> NoReturn:
    """Exit at once, without waiting for torch's threads. All files are already complete."""
    print(f"rlg: {reason}", file=sys.stderr, flush=True)
    os._exit(INTERRUPTED)


# --- commands --------------------------------------------------------------------------------------------------------


def _export(options: argparse.Namespace) -> None:
    from ..opening.blend import export

    with terminal() as progress, progress(f"exporting {options.scene.name}", 1):
        coverage = export(options.scene, options.bundle, blender=options.blender, strict=options.strict, view=chosen_view(options))
    tell_losses(options.bundle, coverage)


def _render(options: argparse.Namespace) -> None:
    settings = render_settings(options, Render())
    if options.frames:
        _animate(options, settings)
    else:
        with _asked_for(options, settings) as (task, progress), progress(task.scene.name, 1) as advance:
            from ..experiments.produce import produce

            produce(task, machine_of(options), lambda pace: advance(pace.share))
        say(options.out / "image.exr")


def _animate(options: argparse.Namespace, settings: Render) -> None:
    view = chosen_view(options)
    if view.frame is not None:
        raise InputError("--frame and --frames exclude each other")
    try:
        with terminal() as progress:
            from ..experiments.animation import animate

            place, machine, method = options.out, machine_of(options), options.preset or ""
            images = animate(place, options.scene, view, options.frames, settings, machine, method, progress, options.blender)
    except KeyboardInterrupt as interrupt:
        raise KeyboardInterrupt("interrupted; the same command goes on from the first frame that is missing") from interrupt
    for path in images:
        say(path)


def _inspect(options: argparse.Namespace) -> None:
    from ..experiments import inspection

    settings = render_settings(options, Render())
    inspection.check(settings.guide)
    with _asked_for(options, settings) as (task, progress):
        pictures = inspection.inspect(task, options.pixel, machine_of(options), progress)
    for path in (options.out / "image.exr", *pictures):
        say(path)


@contextmanager
def _asked_for(options: argparse.Namespace, settings: Render) -> Iterator[tuple[Any, Progress]]:
    """The `Task` of a render, with all kernels ready. After an interrupt it keeps the finished samples."""
    with terminal() as progress, _opening(options.scene, options, progress) as opened:
        from ..experiments.produce import compile_kernels
        from ..experiments.runs import Task  # during Blender's export, which takes about as long as imports and kernels

        compile_kernels([settings.guide], machine_of(options), progress)
        yield Task(options.out, opened(), settings, options.preset or "", keeps_unfinished=True), progress


def _compare(options: argparse.Namespace) -> None:
    from ..experiments.runner import Experiment, run

    asked = comparison_of_methods(options)
    with terminal() as progress:
        scenes = tuple(_open(path, options, progress) for path in options.scenes)
        failed = run([Experiment(options.out, scenes, asked, _command())], machine_of(options), options.jobs, progress)
    _tell([options.out], failed)


def _sweep(options: argparse.Namespace) -> None:
    from ..experiments.runner import Experiment, run

    entries = {name: CATALOGUE[name] for name in chosen(options.names)}
    paths = {scene: _scene_file(options.scenes, scene) for entry in entries.values() for scene in entry.scenes}
    with terminal() as progress:
        scenes = {name: _open(path, options, progress) for name, path in paths.items()}
        experiments = [
            Experiment(options.out / name, tuple(scenes[scene] for scene in entry.scenes), _swept(entry, options), _command(), name)
            for name, entry in entries.items()
        ]
        failed = run(experiments, machine_of(options), options.jobs, progress)
    _tell([experiment.folder for experiment in experiments], failed)


def _swept(entry: Entry, options: argparse.Namespace) -> Comparison:
    """The comparison of an experiment of the slides."""
    methods = tuple(entry.methods.items())
    if options.spp:
        return comparison(options, Comparison(methods, budget="SAMPLES", spp=options.spp, seeds=SEEDS))
    return comparison(options, Comparison(methods, budget="EACH", seeds=SEEDS))


def _scene_file(folder: Path, name: str) -> Path:
    """The .blend with that name; on machines without Blender the bundle of it."""
    found = [path for path in (folder / f"{name}.blend", folder / f"{name}.npz") if path.is_file()]
    if not found:
        raise InputError(f"no scene {name}.blend or {name}.npz in {folder}")
    return found[0]


def _command() -> str:
    return shlex.join(["rlg", *sys.argv[1:]])


def _report(options: argparse.Namespace) -> None:
    _tell([options.out], failed=0)


def _tell(folders: Sequence[Path], failed: int) -> None:
    """Write the reports and print their summaries. At the end, an InputError names failed runs and damaged files."""
    from .. import report

    lacking = [failed_runs(failed)] if failed else []
    damaged: list[str] = []
    for folder in folders:
        try:
            results = report.write(folder)
        except InputError as error:
            lacking.append(str(error))
            continue
        report.show(results, Console())
        say(folder / "report.html")
        damaged += [f"{folder}: {line}" for line in results.damaged]
    if damaged:
        others = f", and {len(damaged) - 1} more" if len(damaged) > 1 else ""
        lacking.append(f"{damaged[0]}{others}: left out, as the report says")
    if lacking:
        raise InputError("; ".join(lacking))


def _metrics(options: argparse.Namespace) -> None:
    from ..images import read_exr
    from ..images.metrics import compare

    print(json.dumps(compare(read_exr(options.image)[0], read_exr(options.reference)[0]), indent=1))


def _alone(command: Callable[[argparse.Namespace], None]) -> Callable[[argparse.Namespace], None]:
    """Run the command with locks on its folders, so that no other process writes to them."""

    def run(options: argparse.Namespace) -> None:
        folders = [options.out / name for name in chosen(options.names)] if "names" in options else [options.out]
        with writing(*folders):
            command(options)

    return run


COMMANDS = {
    "export": _export,
    "render": _alone(_render),
    "inspect": _alone(_inspect),
    "compare": _alone(_compare),
    "sweep": _alone(_sweep),
    "report": _report,
    "metrics": _metrics,
}


# --- what commands have in common -------------------------------------------------------------------------------------------------


def _open(path: Path, options: argparse.Namespace, progress: Progress) -> Any:
    with _opening(path, options, progress) as opened:
        return opened()


@contextmanager
def _opening(path: Path, options: argparse.Namespace, progress: Progress) -> Iterator[Callable[[], Any]]:
    """Begin to open a scene; yields a function that waits for the scene."""
    from ..opening.blend import opening

    def opened() -> Any:
        with progress(f"opening {path.name}", 1):
            scene = wait()
        if scene.coverage:
            first = scene.coverage[0].object
            tell(f"{path.name}: {len(scene.coverage)} thing(s) left out or replaced, {first!r} first; `rlg export` lists them")
        return scene

    with opening(path, options.blender, chosen_view(options)) as wait:
        yield opened
