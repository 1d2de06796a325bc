"""Two cold starts at once on an empty cache: both compile, and render the same bits. Takes minutes."""

import shutil
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from .commands import PATIENCE, Process, called, difference, digest
from .guard import Guard
from .ledger import FoundError, Outcome, outcome_of_check
from .scenes import saved

SIZE = 16  # pixels, both ways
OPTIONS = ("--guide", "qtable", "--qtable.cells", 4, "--spp", 4, "--threads", 1)


def outcomes(steps: range, seed: int, folder: Path) -> Iterator[Outcome]:
    """One outcome for each pair."""
    for step in steps:
        yield outcome_of_check(step, "started", partial(_check, folder))


def _check(folder: Path) -> dict[str, float]:
    """Seconds of the cold starts, and of a start after them."""
    shutil.rmtree(folder, ignore_errors=True)
    guard = Guard(folder, folder / "kernels")
    bundle = saved(guard.root, SIZE)
    shutil.rmtree(guard.cache)
    guard.cache.mkdir()  # empty, without the link to kernels
    command, outs = ("render", bundle, *OPTIONS), [guard.work / name for name in ("one", "other", "after")]
    cold = time.monotonic()
    with Process(guard, *command, "--out", outs[0]) as one, Process(guard, *command, "--out", outs[1]) as other:
        for process in (one, other):
            if status := process.wait(2 * PATIENCE):
                raise FoundError(f"status: {status}, {process.said.strip()[-300:]}")
    warm = time.monotonic()
    with Process(guard, *command, "--out", outs[2]) as after:
        if status := after.wait():
            raise FoundError(f"status: {status} of the start after them, {after.said.strip()[-300:]}")
    end = time.monotonic()
    called(*command, "--out", guard.work / "clean")
    for out in outs:
        if wrong := difference(digest(out), digest(guard.work / "clean")):
            raise FoundError(f"difference: {out.name}, {wrong}")
    return {"cold": warm - cold, "warm": end - warm}


def figures(rows: list[dict[str, float]]) -> dict[str, float]:
    """The seconds of the last pair."""
    return {name: rows[-1][name] for name in ("cold", "warm") if rows and name in rows[-1]}
