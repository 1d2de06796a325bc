"""Runs `trying` in child processes: notices crashes and hangs, keeps the inputs of findings, and starts the next child."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from blender_rl_guiding.errors import InputError

from .guard import Guard
from .ledger import ROOT, Outcome, from_line
from .trying import LIMIT


def outcomes(kind: str, seed: int, first: int, end: int, folder: Path, options: dict[str, Any]) -> Iterator[Outcome]:
    """The outcomes of steps `first` to `end`, in order. `folder`/STEP keeps the input of a finding."""
    bounds = options.pop("bounds", False)
    own = {"kernels": str(folder / "kernels-with-bounds")} if bounds else {}
    guard = Guard(folder / f"surrounding-{kind}", Path(own["kernels"]) if bounds else None)
    environment = os.environ | guard.environment | ({"NUMBA_BOUNDSCHECK": "1"} if bounds else {}) | {"PYTHONPATH": str(ROOT)}
    words = folder / f"{kind}.stderr"
    while first < end:
        command = [sys.executable, "-m", "benchmarks.reliability.trying", kind, str(guard.root), *map(str, (seed, first, end))]
        with (
            words.open("w+") as stderr,
            subprocess.Popen(
                [*command, json.dumps(options | own)], stdout=subprocess.PIPE, stderr=stderr, text=True, env=environment
            ) as child,
        ):
            assert child.stdout
            try:
                for said in child.stdout:
                    outcome = from_line(said)
                    first = outcome.step + 1
                    keep(folder, guard, outcome)
                    yield outcome
            finally:
                if sys.exc_info()[0]:
                    child.kill()
                else:
                    child.wait()
        if first < end:
            died = Outcome(first, "broken", finding=_death(child.wait(), words), seconds=0.0)
            if not guard.work.joinpath(str(first)).exists():
                raise InputError(f"{kind}: {died.finding}")  # it died before the first input: the campaign itself is broken
            keep(folder, guard, died)
            first += 1
            yield died
    words.unlink(missing_ok=True)
    shutil.rmtree(guard.root, ignore_errors=True)


def keep(folder: Path, guard: Guard, outcome: Outcome) -> None:
    """Keep the input of a finding."""
    if outcome.finding and (made := guard.work / str(outcome.step)).exists():
        shutil.rmtree(folder / str(outcome.step), ignore_errors=True)
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copytree(made, folder / str(outcome.step), symlinks=True)
        shutil.rmtree(made, ignore_errors=True)


def _death(status: int, words: Path) -> str:
    last = words.read_text(errors="replace").strip().splitlines()
    ours = next((line.strip() for line in last if "blender_rl_guiding" in line), "")
    if any(line.startswith("Timeout (") for line in last):
        return f"hang: more than {LIMIT:.0f} s, {ours}"
    if status < 0:
        return f"crash: signal {-status}, {ours}"
    return f"crash: status {status}, {(last or [''])[-1]}"
