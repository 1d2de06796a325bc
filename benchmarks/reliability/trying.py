"""Tries many damaged inputs in one process. Each must end in a result or in one line; anything else is a finding.

`python -m benchmarks.reliability.trying KIND ROOT SEED FIRST END OPTIONS` writes one line for each outcome. A crash or a hang ends it.
"""

import faulthandler
import json
import os
import random
import shutil
import sys
import time
import traceback
import warnings
from collections.abc import Iterable, Iterator
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.schema import SettingsError

from .guard import Guard
from .ledger import FoundError, Outcome, line

REFUSALS = (InputError, SettingsError, FloatingPointError)  # errors that the program tells in one line
LIMIT = 180.0  # seconds for one input; the slowest takes two
MEMORY = 1 << 30  # bytes that an input may take
LONGEST = 1000  # longest error, in characters


class Trial(Protocol):
    """A kind of input. One trial makes the sound input once, then damages copies of it."""

    def attempt(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        """Damage an input, leave it in the folder, and use it. Returns (result in a word, error or "").

        Raising one of `REFUSALS` is a result, too.
        """
        ...


def trial(kind: str, guard: Guard, options: dict[str, Any]) -> Trial:
    """The class `Fuzz` of the module named `kind`."""
    return import_module(f"{__package__}.{kind}").Fuzz(guard, **options)


def tried(kind: Trial, guard: Guard, seed: int, steps: Iterable[int]) -> Iterator[Outcome]:
    """Try the inputs of `steps`. Those with a finding stay in the folder of work."""
    for step in steps:
        start, folder, finding, result, said = time.perf_counter(), guard.folder(step), "", "refused", ""
        before = _memory("VmRSS")
        with warnings.catch_warnings(record=True) as warned, guard.watching() as elsewhere:
            warnings.simplefilter("always")
            try:
                result, said = kind.attempt(random.Random(f"{seed} {step}"), folder)
            except REFUSALS as error:
                said = str(error)
                finding = "" if said else "text: the error is empty"
            except FoundError as error:
                result, finding = "broken", str(error)
            except (Exception, SystemExit):  # noqa: BLE001  # any other exception is a finding
                result, finding = "broken", f"traceback: {_last_lines()}"
        finding = finding or _of_text(said) or next((f"write: {what}" for what in elsewhere), "")
        finding = finding or next((f"warning: {w.category.__name__}: {w.message} ({w.filename}:{w.lineno})" for w in warned), "")
        if not finding and (grown := _memory("VmHWM") - before) > MEMORY:
            finding = f"memory: {grown >> 20} MiB"
        if not finding:
            shutil.rmtree(folder, ignore_errors=True)
        yield Outcome(step, result, said[:LONGEST], finding, time.perf_counter() - start)


def _of_text(said: str) -> str:
    """The fault of an error's text, or ""."""
    if len(said.splitlines()) > 1 or not said.isprintable():
        return f"text: not one line that can be shown: {said[:300]!a}"
    return f"text: {len(said)} characters: {said[:200]}" if len(said) > LONGEST else ""


def _memory(name: str) -> int:
    """Bytes of this process: "VmRSS", resident now, or "VmHWM", the most since "VmRSS" was last asked for."""
    if name == "VmRSS":
        with suppress(OSError):
            Path("/proc/self/clear_refs").write_text("5")  # resets VmHWM
    status = Path("/proc/self/status").read_text()
    return next(int(line.split()[1]) * 1024 for line in status.splitlines() if line.startswith(name))


def _last_lines() -> str:
    """The current exception, and the last of our files in its traceback."""
    kind, error, trace = sys.exc_info()
    frames = [f for f in traceback.extract_tb(trace) if f"{os.sep}blender_rl_guiding{os.sep}" in f.filename]
    place = f" at {Path(frames[-1].filename).name}:{frames[-1].lineno} {frames[-1].name}" if frames else ""
    return f"{kind.__name__ if kind else ''}: {ascii(str(error))[:200]}{place}"


def main(arguments: list[str]) -> None:
    kind, root, seed, first, end, options = arguments
    values = json.loads(options)
    kernels = Path(values.pop("kernels")) if "kernels" in values else None
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what other code prints goes to stderr
    faulthandler.enable()
    guard = Guard(Path(root), kernels)
    os.chdir(guard.work)
    outcomes = tried(trial(kind, guard, values), guard, int(seed), range(int(first), int(end)))
    while outcome := _within_limit(outcomes):
        print(line(outcome), file=answers)


def _within_limit(outcomes: Iterator[Outcome]) -> Outcome | None:
    """The next outcome; None after the last. An input that takes too long ends the process."""
    faulthandler.dump_traceback_later(LIMIT, exit=True)
    outcome = next(outcomes, None)
    faulthandler.cancel_dump_traceback_later()
    return outcome


if __name__ == "__main__":
    main(sys.argv[1:])
