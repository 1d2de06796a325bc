"""Renders and comparisons as a child process: jobs come as lines of JSON on stdin, events go as lines of JSON to stdout.

    python -m blender_rl_guiding.worker

It ends when its stdin does, so that it never outlives who started it, and by itself a minute after the job "rest", unless another
comes. Whoever wants a job cancelled kills it: files are whole or not there.
"""

import json
import os
import queue
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from . import __version__
from .errors import InputError, atomic, check_writable
from .schema import SettingsError, from_dict
from .settings import Machine, Render

IDLE = 60.0  # seconds that it rests before it ends
LEAST_PAUSE = 0.25  # seconds between two images
PAUSES = 10  # times as long as an image takes to write: it should cost little

Job = dict[str, Any]


class Events:
    """What is told to whoever started the worker; `experiments.progress.Progress`, too."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def send(self, event: str, **values: Any) -> None:
        """One event."""
        self._stream.write(json.dumps({"event": event, **values}) + "\n")
        self._stream.flush()

    def note(self, text: str) -> None:
        """A line that stays."""
        self.send("note", text=text)

    @contextmanager
    def bar(self, description: str, total: float) -> Iterator[Callable[..., None]]:
        """What is going on for the length of the block, and the share of it that is done."""
        last = {"description": description, "total": total}
        self.send("status", text=description, share=0.0)

        def advance(done: float, **anew: Any) -> None:
            last.update(anew)
            self.send("status", text=last["description"], share=done / last["total"])

        yield advance


class Frames:
    """The image so far, as files that Blender's passes take as they are: PASS.npy, (height, width, channels) float32, bottom row first."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._next = folder, 0.0

    def offer(self, image: Callable[[], np.ndarray]) -> bool:
        """Write the image so far, unless the last one is recent; whether it was written."""
        start = time.perf_counter()
        if start < self._next:
            return False
        self.write("Combined", image())
        now = time.perf_counter()
        self._next = now + max(LEAST_PAUSE, PAUSES * (now - start))
        return True

    def write(self, name: str, pixels: np.ndarray) -> None:
        """Write one pass, (height, width) or (height, width, channels), top row first."""
        with atomic(self._folder / f"{name}.npy") as part:
            np.save(part, np.atleast_3d(pixels)[::-1].astype(np.float32), allow_pickle=False)


def prepare(job: Job, events: Events) -> None:
    """Compile or load what a render with {"settings", "machine"} needs, while its scene is still being made."""
    from .render import warm_up

    settings, machine = _settings(job)
    with events.bar("Compiling kernels (once after an update)", 1):
        warm_up(settings.guide, machine)


def render(job: Job, events: Events) -> None:
    """Render {"bundle"} with {"settings", "machine"}: images into the folder {"frames"}, and the run into {"out"}, each if it is there."""
    from .experiments.runs import save_run
    from .render import Result
    from .render import render as trace
    from .render.beforehand import tell, tell_memory
    from .render.estimate import left
    from .scene.bundle import load

    settings, machine = _settings(job)
    frames = Frames(Path(job["frames"])) if "frames" in job else None
    if "out" in job:
        check_writable(Path(job["out"]))
    scene = load(Path(job["bundle"]))
    (tell if "out" in job else tell_memory)(scene, [settings], machine, events.note)  # Blender lists lamps itself

    def on_pass(state: Result) -> None:
        shown = frames is not None and frames.offer(lambda: _combined(state))
        learning = {name: state.curve[-1][name] for name in ("loss", "cells", "steps") if name in state.curve[-1]}
        so_far = {"samples": state.film.samples, "of": settings.spp, "seconds": state.seconds, "left": left(state, settings)}
        events.send("pass", **so_far, shown=shown, learning=learning)

    result = trace(scene, settings, machine, on_pass)
    if frames:
        _write_passes(frames, result, settings)
    if "out" in job:
        save_run(Path(job["out"]), scene, job.get("method", settings.guide.kind), settings, machine, result, None)
    events.send("done", samples=result.film.samples, seconds=result.seconds, learn_seconds=result.learn_seconds, rays=result.rays)


def _settings(job: Job) -> tuple[Render, Machine]:
    return from_dict(Render, job["settings"]), _machine(job)


def _machine(job: Job) -> Machine:
    return from_dict(Machine, job.get("machine", {}))


def _combined(result: Any) -> np.ndarray:
    return np.dstack([result.image, result.film.alpha()])


def _write_passes(frames: Frames, result: Any, settings: Render) -> None:
    """All passes, as Cycles has them: a denoised image is the image, and the noisy one a pass."""
    from .render.denoise import denoised

    combined = _combined(result)
    if settings.denoise:
        frames.write("Noisy Image", combined)
        combined = np.dstack([denoised(result.film), combined[..., 3]])
    frames.write("Combined", combined)
    for name, pixels in result.film.layers().items():
        frames.write(name, pixels)


def compare(job: Job, events: Events) -> None:
    """Compare {"methods"}, settings by name, on the scene {"bundle"}: runs and report into the folder {"out"}.

    {"seeds"}; the {"reference"} is {"spp"}, or {"file", "about"}; {"command"} is how it was started. If they are there: the pixel
    {"probe"}, {"jobs"} at a time, and {"machine"}. Runs that are done already are kept. `done` tells what `handover.handed_over` does,
    and how many runs failed.
    """
    from .experiments import handover, report
    from .experiments.references import Given
    from .experiments.runner import Experiment, run
    from .scene.bundle import load

    folder, asked = Path(job["out"]), job["reference"]
    check_writable(folder)
    experiment = Experiment(
        folder=folder,
        scenes=(load(Path(job["bundle"])),),
        methods={name: from_dict(Render, settings) for name, settings in job["methods"].items()},
        seeds=tuple(job["seeds"]),
        reference_spp=asked.get("spp", 0),
        command=job["command"],
        probe=job.get("probe"),
        given=Given(Path(asked["file"]), asked["about"]) if "file" in asked else None,
    )
    failed = run([experiment], _machine(job), job.get("jobs", 1), events)
    with events.bar("Report", 1):
        report.write(folder)
        outcome = handover.handed_over(folder)
    events.send("done", failed=failed, **outcome)


def inspect(job: Job, events: Events) -> None:
    """Render {"bundle"} with {"settings", "machine"}, and show what was learnt at {"pixel"}: a run and two pictures into {"out"}."""
    from .experiments import inspection
    from .experiments.probe import described
    from .experiments.runs import save_run
    from .render import Result
    from .render import render as trace
    from .render.beforehand import tell
    from .render.estimate import share
    from .scene.bundle import load

    settings, machine = _settings(job)
    inspection.check(settings.guide)
    out = Path(job["out"])
    check_writable(out)
    scene = load(Path(job["bundle"]))
    tell(scene, [settings], machine, events.note)
    point = inspection.find(scene, job["pixel"], machine)
    with events.bar("Learning", 1) as advance:

        def on_pass(state: Result) -> None:
            advance(share(state, settings))

        result = trace(scene, settings, machine, on_pass, on_pass)
    save_run(out, scene, job.get("method", settings.guide.kind), settings, machine, result, None, described(result.guide, point))
    with events.bar("Measuring the light that arrives", 1):
        pictures = inspection.write(out, scene, point, settings, machine, result)
    events.send("done", pictures=[str(path) for path in pictures])


def wait(_job: Job, _events: Events) -> None:
    """Nobody needs the worker for now ("rest"), or somebody does again, though not at once ("wake")."""


JOBS = {"rest": wait, "wake": wait, "prepare": prepare, "render": render, "compare": compare, "inspect": inspect}


def main() -> None:
    """Do jobs as they come. What the user can mend is an event `error`; anything else ends the worker, with a traceback on stderr."""
    stream = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # whatever prints, prints elsewhere
    events, jobs = Events(stream), _jobs()
    events.send("ready", version=__version__)
    patience = None
    while True:
        try:
            job = jobs.get(timeout=patience)
        except queue.Empty:
            return
        patience = IDLE if job["job"] == "rest" else None
        try:
            JOBS[job["job"]](job, events)
        except (InputError, SettingsError, FloatingPointError) as error:
            events.send("error", text=str(error))


def _jobs() -> "queue.Queue[Job]":
    """The jobs from stdin; with its end the process ends, whatever it is doing."""
    jobs: queue.Queue[Job] = queue.Queue()

    def listen() -> None:
        for line in sys.stdin:
            jobs.put(json.loads(line))
        os._exit(0)

    threading.Thread(target=listen, daemon=True).start()
    return jobs


if __name__ == "__main__":
    main()
