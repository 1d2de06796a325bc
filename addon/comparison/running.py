"""Long work in the background. A timer runs the steps of a generator, so that Blender stays responsive. A command runs all steps in a loop.

Only one piece of work runs at a time. There is no modal operator, because autosave would not work while it runs.
"""

import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import bpy

from blender_rl_guiding.errors import InputError

from .. import areas

INTERVAL = 0.1  # seconds between two polls
SHARE_OF_TIME = 0.02  # maximal seconds of a poll


class Status(NamedTuple):
    """The progress of the work."""

    text: str
    share: float  # 0..1, the finished share of the step in `text`
    note: str = ""  # a line for the log, given once


Steps = Generator[Status, None, dict[str, Any]]  # returns the outcome; InputError is a line for the user
Finish = Callable[[dict[str, Any]], str]  # stores the outcome in the file, and returns a line about it


@dataclass
class Work:
    """Running work."""

    label: str
    steps: Steps
    finish: Finish
    status: Status = field(default_factory=lambda: Status("Starting", 0.0))
    note: str = ""  # the last one
    began: float = field(default_factory=time.monotonic)

    @property
    def line(self) -> str:
        """The running step, and the time since the beginning."""
        minutes, seconds = divmod(int(time.monotonic() - self.began), 60)
        return f"{self.status.text} | {minutes:02}:{seconds:02}"


@dataclass
class State:
    """The running work, or the final line of the last work."""

    work: Work | None = None
    last_words: str = ""
    failed: bool = False


STATE = State()


def start(label: str, steps: Steps, finish: Finish) -> None:
    """Begin the work. InputError while other work is running."""
    if STATE.work:
        raise InputError(f"{STATE.work.label} is still under way: wait for its end, or cancel it")
    STATE.work, STATE.last_words = Work(label, steps, finish), ""
    bpy.app.timers.register(_look, first_interval=0.0, persistent=True)


def complete(label: str, steps: Steps, finish: Finish, on_status: Callable[[Status], None]) -> str:
    """Do all of the work; returns the line of `finish`. InputError if it fails, or while other work is running."""
    if STATE.work:
        raise InputError(f"{STATE.work.label} is still under way: wait for its end, or cancel it")
    while True:
        try:
            on_status(next(steps))
        except StopIteration as end:
            return finish(end.value)


def cancel(why: str = "Cancelled: finished runs are kept, and the next comparison continues") -> None:
    """End the work under way, if any."""
    if STATE.work:
        STATE.work.steps.close()  # which ends the renderer
        _end(why, failed=False)
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)


def _look() -> float | None:
    """Run the steps that are ready; returns the seconds until the next poll."""
    work = STATE.work
    if work is None:
        return None
    try:
        until = time.monotonic() + SHARE_OF_TIME
        while time.monotonic() < until:
            before, work.status = work.status, next(work.steps)
            work.note = work.status.note or work.note
            if work.status == before:
                break
    except StopIteration as end:
        _finish(work, end.value)
    except InputError as error:
        _end(str(error), failed=True)
    redraw()
    return INTERVAL if STATE.work else None


def _finish(work: Work, outcome: dict[str, Any]) -> None:
    try:
        _end(work.finish(outcome), failed=False)
    except InputError as error:
        _end(str(error), failed=True)


def _end(words: str, failed: bool) -> None:
    STATE.work, STATE.last_words, STATE.failed = None, words, failed
    redraw()


def redraw() -> None:
    """Redraw the panel and the status bar."""
    areas.redraw("PROPERTIES", "IMAGE_EDITOR")
    for window in bpy.context.window_manager.windows:
        if not window.modal_operators:  # a modal operator may show its own text there
            window.workspace.status_text_set(None)  # redraws the status bar, because it is no area of the screen


@bpy.app.handlers.persistent
def _on_load(*_: Any) -> None:
    """End the running work, because its file is being closed."""
    cancel("Cancelled, because another file was opened; finished runs are kept")


def register() -> None:
    """Register the handler that ends the work when another file is opened."""
    bpy.app.handlers.load_pre.append(_on_load)


def unregister() -> None:
    """End the work under way."""
    cancel()
    STATE.last_words = ""
    bpy.app.handlers.load_pre.remove(_on_load)
