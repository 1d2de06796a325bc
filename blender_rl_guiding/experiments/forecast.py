"""How far a set of runs has come, and when all of it will be done: by what runs alike have taken, and those under way will take."""

import statistics
from collections import defaultdict
from collections.abc import Iterator, Sequence
from datetime import timedelta

from .tasks import Outcome, Pace, Task


class Forecast:
    """Counts runs that end, and weighs those to come by the seconds that runs alike took."""

    def __init__(self, due: Sequence[Task], jobs: int) -> None:
        self._due, self._jobs, self._count = list(due), jobs, len(due)
        self._paces: dict[Task, Pace] = {}  # of the runs under way
        self._seconds: dict[tuple[str, ...], list[float]] = defaultdict(list)  # of runs alike
        self._all: list[float] = []  # of the runs that ended

    def go(self, task: Task, pace: Pace) -> None:
        """A run under way has come this far."""
        self._paces[task] = pace

    def end(self, task: Task, outcome: Outcome) -> None:
        """A run has ended."""
        self._due.remove(task)
        self._paces.pop(task, None)
        if outcome.seconds is not None:
            self._all.append(outcome.seconds)
            for likeness in _likenesses(task):
                self._seconds[likeness].append(outcome.seconds)

    @property
    def done(self) -> float:
        """Seconds of work that are behind us."""
        return sum(self._all) + sum(pace.share * pace.seconds for pace in self._paces.values())

    @property
    def total(self) -> float:
        """Seconds of work in all, as far as one can tell."""
        unknown = statistics.fmean(self._all) if self._all else 1.0
        return sum(self._all) + sum(self._expected(task) or unknown for task in self._due)

    def __str__(self) -> str:
        """As in "3 of 40, about 0:12:30 to go". It names the methods that it leaves out because nothing like them has run."""
        ended = f"{self._count - len(self._due)} of {self._count}"
        if not self._due or not self._all:
            return ended
        known = [expected for task in self._due if (expected := self._expected(task))]
        behind = sum(pace.share * pace.seconds for pace in self._paces.values())
        left = timedelta(seconds=round((sum(known) - behind) / self._jobs))
        unknown = ", ".join(dict.fromkeys(task.method for task in self._due if not self._expected(task)))
        if not unknown:
            return f"{ended}, about {left} to go"
        untimed = f"{unknown}, whose learning has not been timed yet"
        return f"{ended}, about {left} to go and {untimed}" if known else f"{ended}, to go: {untimed}"

    def _expected(self, task: Task) -> float | None:
        """Seconds of a run, or None while nothing is known of its kind."""
        if task in self._paces:
            return self._paces[task].seconds
        return next((statistics.fmean(self._seconds[likeness]) for likeness in _likenesses(task) if likeness in self._seconds), None)


def _likenesses(task: Task) -> Iterator[tuple[str, ...]]:
    """What runs that take about as long have in common, the best likeness first. Learning takes longer than all else."""
    yield task.method, task.scene.name
    yield (task.method,)
    yield ("", task.settings.guide.kind if task.settings.guide.learns else "")
