"""How far a set of runs has come, and when all of it will be done, by what runs alike have taken."""

import statistics
from collections import defaultdict
from collections.abc import Iterator, Sequence
from datetime import timedelta

from .tasks import Outcome, Task


class Forecast:
    """Counts runs that end, and weighs those to come by the seconds that runs of their method took."""

    def __init__(self, due: Sequence[Task], jobs: int) -> None:
        self._due, self._jobs, self._count = list(due), jobs, len(due)
        self._shares: dict[Task, float] = {}  # of the runs under way
        self._seconds: dict[tuple[str, ...], list[float]] = defaultdict(list)  # of runs alike
        self._spent = 0.0  # by those that ended

    def share(self, task: Task, share: float) -> None:
        """A run under way is done to this share, 0..1."""
        self._shares[task] = share

    def end(self, task: Task, outcome: Outcome) -> None:
        """A run has ended."""
        self._due.remove(task)
        self._shares.pop(task, None)
        if outcome.seconds is not None:
            self._spent += outcome.seconds
            for likeness in _likenesses(task):
                self._seconds[likeness].append(outcome.seconds)

    @property
    def done(self) -> float:
        """Seconds of work that are behind us."""
        return self._spent + sum(share * self._expected(task) for task, share in self._shares.items())

    @property
    def total(self) -> float:
        """Seconds of work in all, as far as one can tell."""
        return self._spent + sum(map(self._expected, self._due))

    def __str__(self) -> str:
        """As in "3 of 40, about 0:12:30 to go"."""
        ended = self._count - len(self._due)
        if not self._due or not self._spent:
            return f"{ended} of {self._count}"
        return f"{ended} of {self._count}, about {timedelta(seconds=round((self.total - self.done) / self._jobs))} to go"

    def _expected(self, task: Task) -> float:
        known = next((self._seconds[likeness] for likeness in _likenesses(task) if likeness in self._seconds), [1.0])
        return statistics.fmean(known)


def _likenesses(task: Task) -> Iterator[tuple[str, ...]]:
    """What runs that take about as long have in common, the best likeness first."""
    yield task.method, task.scene.name
    yield (task.method,)
    yield ()
