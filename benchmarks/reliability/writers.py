"""Two commands write into one folder at once: one does its work, the other fails with a line, and the folder is that of one."""

import shutil
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from .commands import Process, called, difference, digest
from .guard import Guard
from .kills import COMMANDS, SIZE, words
from .ledger import FoundError, Outcome, outcome_of_check
from .scenes import saved


def outcomes(steps: range, seed: int, folder: Path, names: tuple[str, ...] = tuple(COMMANDS)) -> Iterator[Outcome]:
    """One outcome for each pair of commands, in turns."""
    shutil.rmtree(folder, ignore_errors=True)
    guard = Guard(folder)
    bundle = saved(guard.root, SIZE, "a1")
    for step in steps:
        name = names[step % len(names)]
        yield outcome_of_check(step, name, partial(_check, guard, words(name, bundle), guard.folder(step)))


def _check(guard: Guard, command: tuple[object, ...], folder: Path) -> dict[str, float]:
    with guard.here():
        called(*command, "--out", folder / "alone")
    with Process(guard, *command, "--out", folder / "both") as one, Process(guard, *command, "--out", folder / "both") as other:
        statuses = sorted((process.wait() or 0, process.said) for process in (one, other))
    if [status for status, _ in statuses] != [0, 2]:
        raise FoundError(f"writers: they ended with {[status for status, _ in statuses]}: {statuses[1][1].strip()[-200:]}")
    lines = [line for line in statuses[1][1].splitlines() if line.startswith("rlg: ")]
    if len(lines) != 1 or "Traceback" in statuses[1][1]:
        raise FoundError(f"text: the second says {statuses[1][1][-300:]!r}")
    if wrong := difference(digest(folder / "both"), digest(folder / "alone")):
        raise FoundError(f"difference: {wrong}")
    return {}
