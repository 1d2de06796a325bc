"""Runs child programs. A child ends with the block that runs it. It also ends if this process ends in any way."""

import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

from .errors import trying_to


class Child:
    """A running program. It must end when its stdin ends (`addon/lifeline.py`), because the system closes this pipe when this process
    ends.
    """

    def __init__(self, process: "subprocess.Popen[str]", complaints: IO[str]) -> None:
        self.process, self._complaints = process, complaints

    def ended(self, patience: float | None = None) -> bool:
        """Whether it ends within `patience` seconds. With None, wait for its end."""
        try:
            self.process.wait(patience)
        except subprocess.TimeoutExpired:
            return False
        return True

    def fate(self, said: str = "") -> str:
        """The function `fate` for a child that has ended. The last line comes from stderr, or from `said` if stderr is empty."""
        return fate(self.process.returncode, self.complaints() or said.strip())

    def complaints(self) -> str:
        """Its text on stderr so far."""
        self._complaints.seek(0)
        return self._complaints.read().strip()


def fate(status: int, said: str) -> str:
    """A text about the end of a program, with its last line, such as "ended with status 1: no such file"."""
    how = f"was ended by {signal.Signals(-status).name}" if status < 0 else f"ended with status {status}"
    why = said.splitlines()[-1] if said else "too little memory?" if how.endswith("SIGKILL") else "it gave no reason"
    return f"{how}: {why}"


@contextmanager
def running(command: list[str], stdout: int = subprocess.DEVNULL) -> Iterator[Child]:
    """Start a program, and kill it after the block. InputError if it cannot be started."""
    pipe = subprocess.PIPE
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as complaints:  # a pipe without a reader fills up
        with trying_to(f"run {command[0]}"):
            process = subprocess.Popen(command, stdin=pipe, stdout=stdout, stderr=complaints, text=True, errors="replace")
        with process:
            try:
                yield Child(process, complaints)
            finally:
                process.kill()  # has no effect on a process that has ended
