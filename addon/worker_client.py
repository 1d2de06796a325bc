"""The renderer as a child process: starts it, sends it jobs, hears its events, ends it. See `blender_rl_guiding.messages`."""

import queue
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from blender_rl_guiding import __version__, messages
from blender_rl_guiding.children import fate
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.typed import MalformedError


class Worker:
    """One renderer process. If it fails, an InputError has a line for the user."""

    def __init__(self, python: Path) -> None:
        self.python = python
        self._complaints = tempfile.TemporaryFile()  # noqa: SIM115  # as long as the child; a pipe that nobody reads would fill up
        pipe = subprocess.PIPE
        try:
            # Isolated (-I): variables such as PYTHONPATH, set by Blender or the user, must not change the imports. With its own session,
            # Ctrl-C in Blender's terminal reaches only Blender.
            self._child = subprocess.Popen(
                [str(python), "-I", "-m", "blender_rl_guiding.doors.worker"],
                stdin=pipe, stdout=pipe, stderr=self._complaints, start_new_session=True,
            )  # fmt: skip
        except OSError as error:
            self._complaints.close()
            raise InputError(f"cannot start the renderer, {python}: {error.strerror or error}") from error
        self._end_of_life = ""
        self._events: queue.Queue[dict[str, Any] | MalformedError | None] = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    @property
    def alive(self) -> bool:
        """Whether the renderer can take another job."""
        return self._child.poll() is None

    def send(self, job: messages.Job) -> None:
        """Send a job. The renderer does jobs one after the other."""
        assert self._child.stdin
        if not self.alive:
            raise InputError(self._death())
        try:
            self._child.stdin.write(messages.line_of(job))
            self._child.stdin.flush()
        except OSError as error:
            raise InputError(self._death()) from error

    def event(self, timeout: float) -> dict[str, Any]:
        """The next event; {"event": "none"} after a timeout in seconds. InputError if the job failed or the renderer died."""
        try:
            event = self._events.get(timeout=timeout)
        except queue.Empty:
            return {"event": "none"}
        if event is None:
            self._events.put(None)
            raise InputError(self._death())
        if isinstance(event, MalformedError):
            raise InputError(f"the renderer {self.python} said something that is no event of its: {event}")
        if event["event"] == "error":
            raise InputError(event["text"])
        if event["event"] == "ready" and event["version"] != __version__:
            raise InputError(
                f"the renderer {self.python} is version {event['version']}, this add-on {__version__}: update both (./build.sh setup)"
            )
        return event

    def end(self) -> None:
        """End the renderer at once, even during a job."""
        self._child.kill()
        self._death()

    def _listen(self) -> None:
        assert self._child.stdout
        with self._child.stdout as stream:
            for line in messages.lines(stream):
                self._events.put(_event(line))
        self._events.put(None)

    def _death(self) -> str:
        """The reason for the renderer's end: its status, and its last line."""
        if not self._complaints.closed:
            self._end_of_life = self._read_death()
        return self._end_of_life

    def _read_death(self) -> str:
        status = self._child.wait()
        assert self._child.stdin
        with suppress(OSError):  # closing writes data that the renderer did not read
            self._child.stdin.close()
        with self._complaints as file:
            file.seek(0)
            return f"the renderer {fate(status, file.read().decode('utf-8', 'replace').strip())}"


def _event(line: bytes) -> dict[str, Any] | MalformedError:
    try:
        return messages.read_event(line)
    except MalformedError as error:
        return error


@contextmanager
def borrowed(python: Path) -> Iterator[Worker]:
    """A renderer for the block: the last renderer if it is still alive, otherwise a new one. This saves two seconds per frame.

    If the block fails, the renderer is ended.
    """
    worker = _warm(python) or Worker(python)
    try:
        yield worker
    except BaseException:
        worker.end()
        raise
    with suppress(InputError):  # it is not there any more
        worker.send(messages.Rest())
        _SPARE.append((time.monotonic(), worker))


_SPARE: list[tuple[float, Worker]] = []  # idle renderers, each with the time of its last job
_WARM = 45.0  # seconds; an idle renderer ends by itself after sixty


def _warm(python: Path) -> Worker | None:
    while _SPARE:
        since, worker = _SPARE.pop()
        if worker.python == python and time.monotonic() - since < _WARM:
            with suppress(InputError):  # it is not there any more
                worker.send(messages.Wake())
                return worker
        worker.end()
    return None


def end_all() -> None:
    """End the idle renderers."""
    while _SPARE:
        _SPARE.pop()[1].end()
