"""The progress and remaining time of a set of runs. A run's time comes from its own pace, or from finished runs of the same kind."""

import statistics
from collections import defaultdict
from collections.abc import Iterator, Sequence
from datetime import timedelta

from ..pace import Pace
from .pool import Outcome
from .runs import Task


class Forecast:
    """Counts finished runs. Each remaining run counts with the seconds of similar runs."""

    def __init__(self, due: Sequence[Task], jobs: int) -> None:
        self._due, self._jobs, self._count = list(due), jobs, len(due)
        self._paces: dict[Task, Pace] = {}  # of the running runs
        self._seconds: dict[tuple[str, ...], list[float]] = defaultdict(list)  # of similar runs
        self._all: list[float] = []  # of the runs that ended

    def go(self, task: Task, pace: Pace) -> None:
        """Note the progress of a running run."""
        self._paces[task] = pace

    def end(self, task: Task, outcome: Outcome) -> None:
        """Note the end of a run."""
        self._due.remove(task)
        self._paces.pop(task, None)
        if outcome.seconds is not None:
            self._all.append(outcome.seconds)
            for likeness in _likenesses(task):
                self._seconds[likeness].append(outcome.seconds)

    @property
    def done(self) -> float:
        """Seconds of work done."""
        return sum(self._all) + self._under_way

    @property
    def total(self) -> float:
        """Seconds of all work. A run of an unknown kind counts with the mean of the finished runs."""
        unknown = statistics.fmean(self._all) if self._all else 1.0
        return sum(self._all) + sum(self._expected(task) or unknown for task in self._due)

    def __str__(self) -> str:
        """For example "3 of 40, about 0:12:30 to go". Methods without a similar run are not in the estimate; the text names them."""
        ended = f"{self._count - len(self._due)} of {self._count}"
        if not self._due or not self._all:
            return ended
        known = [expected for task in self._due if (expected := self._expected(task))]
        left = timedelta(seconds=round((sum(known) - self._under_way) / self._jobs))
        unknown = ", ".join(dict.fromkeys(task.method for task in self._due if not self._expected(task)))
        if not unknown:
            return f"{ended}, about {left} to go"
        untimed = f"{unknown}, whose learning has not been timed yet"
        return f"{ended}, about {left} to go and {untimed}" if known else f"{ended}, to go: {untimed}"

    @property
    def _under_way(self) -> float:
        """Seconds that the running runs have taken so far."""
        return sum(pace.seconds for pace in self._paces.values())

    def _expected(self, task: Task) -> float | None:
        """Total seconds of a run; None if no similar run has ended."""
        if task in self._paces:
            return self._paces[task].seconds + self._paces[task].left
        return next((statistics.fmean(self._seconds[likeness]) for likeness in _likenesses(task) if likeness in self._seconds), None)


def _likenesses(task: Task) -> Iterator[tuple[str, ...]]:
    """The keys of groups of similar runs, the most similar group first. A guide that learns has its own last key: learning takes most
    time.
    """
    yield task.method, task.scene.name
    yield (task.method,)
    yield ("", task.settings.guide.kind if task.settings.guide.learns else "")
