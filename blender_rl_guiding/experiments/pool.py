"""Several runs at a time, each in its own process. So a crash ends only one run, and runs do not share threads of Numba and torch."""

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from typing import NamedTuple

from ..children import fate
from ..errors import InputError
from ..notices import heard_by, tell
from ..pace import Pace
from ..render import warm_up
from ..settings import Machine
from .produce import OnPace, produce
from .runs import Task

PATIENCE = 1.0  # seconds for a child to finish its files before it is killed


class Outcome(NamedTuple):
    """A line about the end of a run, and its seconds, or None if it failed."""

    text: str
    seconds: float | None


def perform_all(
    tasks: Sequence[Task], machine: Machine, jobs: int, on_pace: Callable[[Task, Pace], None], on_end: Callable[[Task, Outcome], None]
) -> None:
    """Do all runs, `jobs` at a time. With `jobs` = 1 they run in this process. Images do not depend on `jobs`.

    on_pace, on_end: called in this process.
    A run that fails, or whose process dies, ends as an Outcome without seconds. The others go on.
    """
    if jobs == 1:
        for task in tasks:
            on_end(task, _attempt(task, machine, lambda pace, task=task: on_pace(task, pace)))
        return
    waiting = iter(tasks)
    with _workers(min(jobs, len(tasks)), replace(machine, threads=threads_each(machine, jobs))) as workers:
        for worker in workers:
            worker.give(next(waiting))
        while busy := {worker.pipe: worker for worker in workers if worker.task}:
            for pipe in wait(list(busy)):
                worker = busy[pipe]  # type: ignore[index]  # these are the connections that went in
                task, told = worker.hear()
                if isinstance(told, str):
                    tell(told)
                elif isinstance(told, Pace):
                    on_pace(task, told)
                else:
                    on_end(task, told)
                    if following := next(waiting, None):
                        worker.give(following)


def _attempt(task: Task, machine: Machine, on_pace: OnPace) -> Outcome:
    """Do a run of a comparison. If it fails, the other runs must go on."""
    try:
        result = produce(task, machine, on_pace)
    except (InputError, FloatingPointError) as error:
        return Outcome(str(error), None)
    return Outcome(f"{result.seconds:.1f} s, mape_display {result.curve[-1]['mape_display']:.4f}", result.seconds)


def threads_each(machine: Machine, jobs: int) -> int:
    """Rendering threads of each of `jobs` processes."""
    return max(1, (machine.threads or os.cpu_count() or 1) // jobs)


class _Worker:
    """A child process that does one run after another, and our end of its pipe. A new child replaces a child that died."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self.task: Task | None = None
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")  # a fork would inherit locks of threads that do not exist in the child
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, self._machine), daemon=True)
        # Ctrl-C reaches every process of a terminal. Only the parent should handle it, so it is blocked here; a child inherits this.
        resource_tracker.ensure_running()  # otherwise the first child's start would do this, and unblock SIGINT too early
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self.process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        theirs.close()

    def give(self, task: Task) -> None:
        if self.process.exitcode is not None:
            self._start()
        self.task = task
        with contextlib.suppress(ConnectionError):  # the child died; `hear` will report it
            self.pipe.send(task)

    def hear(self) -> tuple[Task, Pace | str | Outcome]:
        """The child's task, with its pace, a line for the user, or its outcome."""
        task = self.task
        assert task
        try:
            told = self.pipe.recv()
        except (EOFError, ConnectionError):
            self.process.join()
            told = Outcome(f"its process {fate(self.process.exitcode or 0, '')}", None)
        if isinstance(told, Outcome):
            self.task = None
        return task, told


@contextlib.contextmanager
def _workers(count: int, machine: Machine) -> Iterator[list[_Worker]]:
    """Several children. None outlives the block."""
    workers: list[_Worker] = []
    try:
        for _ in range(count):
            workers.append(_Worker(machine))  # noqa: PERF401  # if one cannot start, the earlier ones must also end
        yield workers
    finally:
        for worker in workers:
            worker.process.terminate()
        for worker in workers:
            worker.process.join(PATIENCE)
            worker.process.kill()  # has no effect on a process that has ended


def _serve(pipe: Connection, machine: Machine) -> None:
    """The main loop of a child: it does the tasks from the pipe until its parent ends or a signal comes."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # as an exception, so that no file is left half-written
    ready: set[str] = set()
    try:
        with heard_by(pipe.send):
            while True:
                task: Task = pipe.recv()
                kind = task.settings.guide.kind
                if kind not in ready:
                    warm_up(task.settings.guide, machine)
                    ready.add(kind)
                pipe.send(_attempt(task, machine, pipe.send))
    except (EOFError, ConnectionError):
        return
    except KeyboardInterrupt:
        os._exit(1)  # torch's threads are not waited for


def _end_with_parent() -> None:
    """End this process at once when the parent ends; otherwise a run would continue until its next message."""
    parent = multiprocessing.parent_process()
    assert parent
    parent.join()
    os._exit(1)
