"""The worker: a child process that renders and compares. It reads jobs from stdin and writes events to stdout, as JSON lines (`messages`).

    python -m blender_rl_guiding.doors.worker

The worker ends when its stdin ends, so it never outlives its parent. It also ends one minute after the job "rest" if there is no new job.
To cancel a job, the parent kills the worker; every file is then either complete or absent.
"""

import json
import os
import queue
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from .. import __version__, messages
from ..comparison import Comparison
from ..errors import InputError, atomic
from ..locks import writing
from ..notices import heard_by, tell
from ..pace import Pace
from ..schema import from_dict
from ..settings import Machine, Render
from ..strings import printable
from ..typed import MalformedError

IDLE = 60.0  # seconds from "rest" to its end
LEAST_PAUSE = 0.25  # seconds between two images
PAUSES = 10  # pause between two images / time to write an image, so that writing costs little


class Events:
    """Sends events to the program that started the worker."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def send(self, event: str, **values: Any) -> None:
        """One event."""
        try:
            self._stream.write(json.dumps({"event": event, **values}) + "\n")
            self._stream.flush()
        except BrokenPipeError:  # the parent is gone, as at the end of stdin
            os._exit(0)

    def note(self, text: str) -> None:
        """Send a line for the log."""
        self.send("note", text=printable(text))

    @contextmanager
    def bar(self, description: str, total: float) -> Iterator[Callable[..., None]]:
        """An `experiments.progress.Progress`: the running step of the block, and its finished share."""
        last = {"description": description, "total": total}
        self.send("status", text=printable(description), share=0.0)

        def advance(done: float, **anew: Any) -> None:
            last.update(anew)
            self.send("status", text=printable(last["description"]), share=min(1.0, done / last["total"]))  # totals are forecasts

        yield advance


class Frames:
    """The image so far, as files in the layout of Blender's passes: PASS.npy, (height, width, channels) float32, bottom row first."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._next = folder, 0.0

    def offer(self, image: Callable[[], np.ndarray]) -> bool:
        """Write the image so far, unless the last image is recent. Returns whether it was written."""
        start = time.perf_counter()
        if start < self._next:
            return False
        self.write("Combined", image())
        now = time.perf_counter()
        self._next = now + max(LEAST_PAUSE, PAUSES * (now - start))
        return True

    def write(self, name: str, pixels: np.ndarray) -> None:
        """Write one pass, (height, width) or (height, width, channels), top row first."""
        with atomic(self._folder / f"{name}.npy", durable=False) as part:
            np.save(part, np.atleast_3d(pixels)[::-1].astype(np.float32), allow_pickle=False)


def prepare(job: messages.Prepare, events: Events) -> None:
    """See `messages.Prepare`."""
    from ..render import warm_up

    settings, machine = _settings(job)
    with events.bar("Compiling kernels (once after an update)", 1):
        warm_up(settings.guide, machine)


def render(job: messages.Render, events: Events) -> None:
    """See `messages.Render`."""
    from ..experiments.produce import produce
    from ..experiments.runs import Task
    from ..render import Result
    from ..scene.bundle import load

    settings, machine = _settings(job)
    frames, out = Frames(Path(job.frames)) if job.frames else None, Path(job.out) if job.out else None

    def on_pass(state: Result, pace: Pace) -> None:
        shown = frames is not None and frames.offer(lambda: _combined(state))
        learning = {name: state.curve[-1][name] for name in ("loss", "cells", "steps") if name in state.curve[-1]}
        so_far = {"samples": state.film.samples, "of": settings.spp, "seconds": pace.seconds, "left": pace.left}
        events.send("pass", **so_far, shown=shown, learning=learning)

    def on_end(result: Result) -> None:
        if frames:
            _write_passes(frames, result, settings)

    result = produce(Task(out, load(Path(job.bundle)), settings, job.method or ""), machine, on_pass=on_pass, on_end=on_end)
    events.send("done", samples=result.film.samples, seconds=result.seconds, learn_seconds=result.learn_seconds, rays=result.rays)


def _settings(job: messages.Prepare | messages.Render | messages.Inspect) -> tuple[Render, Machine]:
    return from_dict(Render, job.settings), from_dict(Machine, job.machine)


def _combined(result: Any) -> np.ndarray:
    return np.dstack([result.image, result.film.alpha()])


def _write_passes(frames: Frames, result: Any, settings: Render) -> None:
    """All passes. As in Cycles, the denoised image is the main image, and the noisy image is a pass."""
    from ..render.denoise import denoised

    combined = _combined(result)
    if settings.denoise:
        frames.write("Noisy Image", combined)
        combined = np.dstack([denoised(result.film), combined[..., 3]])
    frames.write("Combined", combined)
    for name, pixels in result.film.layers().items():
        frames.write(name, pixels)


def compare(job: messages.Compare, events: Events) -> None:
    """See `messages.Compare`. `done` has the fields of `handover.handed_over`, and the number of runs that failed."""
    from .. import report
    from ..experiments.references import Given
    from ..experiments.runner import Experiment, run
    from ..report import handover
    from ..scene.bundle import load

    folder, asked = Path(job.out), from_dict(Comparison, job.comparison)
    cycles = Given(Path(job.cycles.file), job.cycles.about) if job.cycles else None
    experiment = Experiment(folder, (load(Path(job.bundle)),), asked, job.command, cycles=cycles)
    failed = run([experiment], from_dict(Machine, job.machine), job.jobs, events.bar)
    with events.bar("Report", 1):
        results = report.write(folder)
        outcome = handover.handed_over(results)
    for line in results.damaged:
        tell(f"FAILED: {line}")
    events.send("done", failed=failed + len(results.damaged), **outcome)


def inspect(job: messages.Inspect, events: Events) -> None:
    """See `messages.Inspect`."""
    from ..experiments import inspection
    from ..experiments.runs import Task
    from ..scene.bundle import load

    settings, machine = _settings(job)
    inspection.check(settings.guide)
    task = Task(Path(job.out), load(Path(job.bundle)), settings, job.method or "")
    pictures = inspection.inspect(task, job.pixel, machine, events.bar)
    events.send("done", pictures=[str(path) for path in pictures])


WORK: dict[type[Any], Callable[[Any, Events], None]] = {
    messages.Prepare: prepare,
    messages.Render: render,
    messages.Compare: compare,
    messages.Inspect: inspect,
}


def main() -> None:
    """Do jobs in their order. A fault that the user can fix is an event `error`; any other error ends the worker with a traceback on
    stderr.
    """
    stream = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # all other prints go to stderr
    events, waiting = Events(stream), _listening()
    events.send("ready", version=__version__)
    patience = None
    while True:
        try:
            line = waiting.get(timeout=patience)
        except queue.Empty:
            return
        try:
            job = messages.read_job(line)
            patience = IDLE if isinstance(job, messages.Rest) else None
            _do(job, events)
        except MalformedError as error:
            events.send("error", text=f"the renderer cannot do this job: {error}")
        except (InputError, FloatingPointError, OSError) as error:
            events.send("error", text=printable(str(error)))


def _do(job: messages.Job, events: Events) -> None:
    """Do a job, with a lock on its folder `out` if it has one. Some jobs need no work."""
    out = getattr(job, "out", None)
    with heard_by(events.note), writing(*[Path(out)] if out else []):
        if work := WORK.get(type(job)):
            work(job, events)


def _listening() -> "queue.Queue[bytes]":
    """The lines from stdin. When stdin ends, the process ends at once."""
    waiting: queue.Queue[bytes] = queue.Queue()

    def listen() -> None:
        with open(0, "rb", closefd=False) as stdin:  # not sys.stdin, because Python takes its lock at exit
            for line in messages.lines(stdin):
                waiting.put(line)
        os._exit(0)

    threading.Thread(target=listen, daemon=True).start()
    return waiting


if __name__ == "__main__":
    main()
