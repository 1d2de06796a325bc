"""One run of an experiment: what it needs, and doing it, in this process or in another."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from ..errors import InputError
from ..images.metrics import compare
from ..render import Result, render
from ..render.checkpoint import in_folder
from ..render.estimate import left, share
from ..scene.data import SceneData
from ..settings import Machine, Render
from .probe import Point, described
from .runs import ON_THE_WAY, Judge, save_run


@dataclass(frozen=True, eq=False)
class Task:
    """A run to be made. It can be pickled."""

    folder: Path
    scene: SceneData
    judge: Judge
    method: str
    settings: Render
    probe: Point | None = None  # where to ask the guide what it has learnt

    @property
    def label(self) -> str:
        """The run's name for people."""
        return f"{self.scene.name} {self.method} seed {self.settings.seed}"


class Pace(NamedTuple):
    """How far a run has come."""

    share: float  # 0..1 of its time
    seconds: float  # that it will have taken in the end, as it looks now


class Outcome(NamedTuple):
    """How a run ended, in one line, and its seconds; None where it failed."""

    text: str
    seconds: float | None


def attempt(task: Task, machine: Machine, on_pace: Callable[[Pace], None]) -> Outcome:
    """Do a run; one that fails must not end the others. `on_pace` is told now and then how far it is."""
    try:
        return _perform(task, machine, on_pace)
    except (InputError, FloatingPointError) as error:
        return Outcome(str(error), None)


def _perform(task: Task, machine: Machine, on_pace: Callable[[Pace], None]) -> Outcome:
    checkpoint = in_folder(task.folder, judged_by=task.judge.key)

    def on_pass(state: Result) -> None:
        state.curve[-1] |= {measure.__name__: measure(state.image, task.judge.truth) for measure in ON_THE_WAY}
        tell(state)

    def tell(state: Result) -> None:
        on_pace(Pace(share(state, task.settings), state.seconds + left(state, task.settings)))

    result = render(task.scene, task.settings, machine, on_pass, tell, checkpoint)
    metrics = compare(result.image, task.judge.truth)
    learnt = described(result.guide, task.probe)
    save_run(task.folder, task.scene, task.method, task.settings, machine, result, metrics, learnt, task.judge.key)
    checkpoint.remove()
    return Outcome(f"{result.seconds:.1f} s, mape_display {metrics['mape_display']:.4f}", result.seconds)
