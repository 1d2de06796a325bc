"""Makes a run: renders it, measures its errors, saves it, and writes checkpoints meanwhile. All entry points use this module."""

from collections.abc import Callable, Sequence

from ..guide_settings import GuideSettings
from ..images.metrics import compare
from ..pace import Pace
from ..render import Result, render, warm_up
from ..render.beforehand import forewarn, forewarn_of_memory
from ..render.checkpoint import Checkpoint, in_cache, in_folder
from ..render.result import pace
from ..settings import Machine
from .probe import described
from .progress import Progress
from .runs import ON_THE_WAY, Task, save_run

OnPace = Callable[[Pace], None]
OnPass = Callable[[Result, Pace], None]


def ignored(*_: object) -> None:
    """The default listener, which does nothing."""


def compile_kernels(guides: Sequence[GuideSettings], machine: Machine, progress: Progress) -> None:
    """Compile all code for runs with these guides, before any run is timed."""
    with progress("compiling kernels (once after an update)", len(guides)) as advance:
        for done, guide in enumerate(guides):
            warm_up(guide, machine)
            advance(done + 1)


def produce(
    task: Task, machine: Machine, on_pace: OnPace = ignored, on_pass: OnPass = ignored, on_end: Callable[[Result], None] = ignored
) -> Result:
    """Make a run, and save it if it has a folder. A run that was killed goes on from its checkpoint.

    on_pace: called after each pass, and from time to time while a guide trains.
    on_pass: called after each pass, with the state so far.
    on_end: called with the complete result, before the result is saved and the checkpoint is removed.
    InputError if the scene does not fit into memory or the folder cannot be written.
    FloatingPointError if radiance is not finite: this is a fault of the tracer.
    """
    if not task.forewarned:
        warn = forewarn if task.folder else forewarn_of_memory  # without a folder the render comes from Blender, which lists lamps itself
        warn(task.scene, [task.settings], machine)
    checkpoint, watch = _checkpoint(task), _Watch(task, on_pace, on_pass)
    try:
        result = render(task.scene, task.settings, machine, watch.passed, watch.step, checkpoint)
    except KeyboardInterrupt as interrupt:
        if not task.keeps_unfinished:
            raise
        if watch.last:
            _save(task, machine, watch.last)
        raise KeyboardInterrupt(_interrupted(task, watch.last, checkpoint)) from interrupt
    on_end(result)
    _save(task, machine, result)
    if checkpoint:
        checkpoint.remove()
    return result


def _checkpoint(task: Task) -> Checkpoint | None:
    if not task.folder:
        return in_cache(task.scene, task.settings)
    return in_folder(task.folder, task.suffix, task.judge.key if task.judge else "")


class _Watch:
    """Measures the errors of each pass, and reports them to the caller."""

    def __init__(self, task: Task, on_pace: OnPace, on_pass: OnPass) -> None:
        self._task, self._on_pace, self._on_pass = task, on_pace, on_pass
        self.last: Result | None = None  # the state after the last whole pass

    def step(self, state: Result) -> None:
        self._on_pace(pace(state, self._task.settings))

    def passed(self, state: Result) -> None:
        self.last = state
        if judge := self._task.judge:
            state.curve[-1] |= {measure.__name__: measure(state.image, judge.truth) for measure in ON_THE_WAY}
        self.step(state)
        self._on_pass(state, pace(state, self._task.settings))


def _save(task: Task, machine: Machine, result: Result) -> None:
    metrics = compare(result.image, task.judge.truth) if task.judge else None
    save_run(task, machine, result, metrics, described(result.guide, task.probe))


def _interrupted(task: Task, last: Result | None, checkpoint: Checkpoint | None) -> str:
    """The final line of a run that Ctrl-C has ended."""
    samples = last.film.samples if last else 0
    kept = checkpoint.samples if checkpoint else 0
    again = f"; the same command goes on from sample {kept}" if kept else ""
    return f"interrupted after {samples} of {task.settings.spp} samples{again}"
