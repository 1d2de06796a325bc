"""`rlg` for campaigns: in this process, or in a child process that can be killed; and digests of its folders."""

import contextlib
import csv
import hashlib
import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from blender_rl_guiding.images import read_exr

from .guard import Guard
from .ledger import ROOT, FoundError

PATIENCE = 900.0  # time limit of each wait in seconds; the slowest takes 60
GOES_ON = "goes on from"  # a part of the line of a render that starts from a checkpoint
# Keys of values that depend on the clock or the machine, and of checksums of these.
TIMES = {"seconds", "learn_seconds", "train_seconds", "infer_seconds", "machine", "command", "sha256"}
SMALL = (  # a network that learns quickly
    *("--dqn.layers", "2", "--dqn.width", "8", "--dqn.rows", "3", "--dqn.columns", "4", "--dqn.cells", "4"),
    *("--dqn.learning-starts", "64", "--dqn.batch", "64", "--dqn.first-steps", "4", "--dqn.steps", "2"),
)


def called(*arguments: object) -> tuple[int, str]:
    """Run `rlg` with arguments in this process. Returns (status, stderr)."""
    from blender_rl_guiding.doors import cli

    with contextlib.redirect_stderr(io.StringIO()) as said, contextlib.redirect_stdout(io.StringIO()):
        try:
            status = cli.main([*map(str, arguments)])
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 1
    return status, said.getvalue()


# `rlg` without the least time between two checkpoints.
_PROGRAM = """
import sys
from blender_rl_guiding.doors.cli import main
from blender_rl_guiding.render import checkpoint
checkpoint.SHARE = 0
sys.exit(main())
"""


class Process:
    """`rlg` with arguments in a child process with its own session; stderr goes into a file. A context manager."""

    def __init__(self, guard: Guard, *arguments: object) -> None:
        self._words = guard.root / f"words-{time.monotonic_ns()}"
        environment = os.environ | guard.environment | {"PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-c", _PROGRAM, *map(str, arguments)]
        with self._words.open("w") as words:
            self._process = subprocess.Popen(
                command, stdout=subprocess.DEVNULL, stderr=words, cwd=guard.work, env=environment, start_new_session=True
            )

    def __enter__(self) -> "Process":
        return self

    def __exit__(self, *_: object) -> None:
        self.kill(group=True)
        self._words.unlink(missing_ok=True)

    @property
    def said(self) -> str:
        """Its stderr so far."""
        return self._words.read_text(encoding="utf-8", errors="replace")

    @property
    def done(self) -> bool:
        return self._process.poll() is not None

    def wait(self, seconds: float = PATIENCE) -> int | None:
        """Its status, or None if it still runs after `seconds`."""
        try:
            return self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return None

    def wait_for_another(self, file: Path) -> None:
        """Wait until it writes a file anew, or ends."""
        before, end = _stamp(file), time.monotonic() + PATIENCE
        while _stamp(file) in (before, None) and not self.done and time.monotonic() < end:
            time.sleep(0.005)

    def kill(self, group: bool) -> None:
        """Send SIGKILL to it, and with `group` to all processes of its session."""
        with contextlib.suppress(ProcessLookupError):
            if group:
                os.killpg(self._process.pid, signal.SIGKILL)
            else:
                self._process.kill()
        self._process.wait()

    def orphans(self) -> list[str]:
        """The processes of its session that are still alive after thirty seconds, at most."""
        end = time.monotonic() + 30.0
        while (left := _session(self._process.pid)) and time.monotonic() < end:
            time.sleep(0.05)
        return left


def _stamp(file: Path) -> tuple[int, int] | None:
    try:
        info = file.stat()
    except FileNotFoundError:
        return None
    return info.st_mtime_ns, info.st_ino


def _session(leader: int) -> list[str]:
    """The names of living processes of a session."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            name, _, rest = stat.read_text(errors="replace").rpartition(")")
            state, _, _, session = rest.split()[:4]
            if int(session) == leader and state != "Z":
                found.append(name.partition("(")[2])
    return found


def outcome_of(status: int, said: str) -> tuple[str, str]:
    """(result in a word, last line of stderr). FoundError on a traceback, or on a status other than success and refusal."""
    lines = said.strip().splitlines()
    if "Traceback" in said:
        raise FoundError(f"traceback: {lines[-1]}")
    if status not in (0, 2):
        raise FoundError(f"status: {status}, {lines[-1:]}")
    return ("accepted", "") if status == 0 else ("refused", lines[-1] if lines else "")


def digest(folder: Path) -> dict[str, Any]:
    """The contents of a folder's files by name: pixels, numbers and tables without times. ValueError if a file is not whole.

    Of other files only whether they are empty: pages and diagrams show times.
    """
    found: dict[str, Any] = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_dir() or path.name == ".lock":
            continue
        if path.suffix == ".exr":
            found[name] = hashlib.sha256(read_exr(path)[0].tobytes()).hexdigest()
        elif path.suffix == ".json":
            found[name] = _without_times(json.loads(path.read_text(encoding="utf-8")))
        elif path.name == "table.csv":
            rows = csv.DictReader(io.StringIO(path.read_text(encoding="utf-8")))
            found[name] = [{key: value for key, value in row.items() if key not in TIMES} for row in rows]
        elif path.name in ("image.png", "reference.png"):
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        else:
            found[name] = path.stat().st_size > 0
    return found


def difference(ours: dict[str, Any], theirs: dict[str, Any]) -> str:
    """The first file that differs, in a few words, or ""."""
    for name in sorted(ours.keys() | theirs.keys()):
        if ours.get(name) != theirs.get(name):
            return f"{name} is missing" if name not in ours else f"{name} is too many" if name not in theirs else f"{name} differs"
    return ""


def leftovers(*folders: Path) -> list[str]:
    """Files that a command should have removed."""
    return [str(path.relative_to(folder)) for folder in folders for path in folder.rglob("*") if _is_left(path)]


def _is_left(path: Path) -> bool:
    return (path.name.startswith(".") and path.name != ".lock") or (path.name.startswith("checkpoint") and path.suffix == ".npz")


def _without_times(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_times(part) for key, part in value.items() if key not in TIMES}
    return [_without_times(part) for part in value] if isinstance(value, list) else value
