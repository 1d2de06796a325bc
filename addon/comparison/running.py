"""Long work in the background. A timer takes the steps of a generator, so that Blender stays responsive; a command takes all at once.

One piece of work at a time. A modal operator would hold back autosave for as long as it runs, so there is none.
"""

import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import bpy

from blender_rl_guiding.errors import InputError

from .. import areas

INTERVAL = 0.1  # seconds between two looks
SHARE_OF_TIME = 0.02  # seconds that a look may take


class Status(NamedTuple):
    """How far the work is."""

    text: str
    share: float  # 0..1 of what the text names
    note: str = ""  # a line that stays, told once


Steps = Generator[Status, None, dict[str, Any]]  # returns the outcome; InputError is a line for the user
Finish = Callable[[dict[str, Any]], str]  # takes the outcome over into the file, and says in a line what it was


@dataclass
class Work:
    """Work under way."""

    label: str
    steps: Steps
    finish: Finish
    status: Status = field(default_factory=lambda: Status("Starting", 0.0))
    note: str = ""  # the last one
    began: float = field(default_factory=time.monotonic)

    @property
    def line(self) -> str:
        """The step under way, and the time since the beginning."""
        minutes, seconds = divmod(int(time.monotonic() - self.began), 60)
        return f"{self.status.text} | {minutes:02}:{seconds:02}"


@dataclass
class State:
    """The work under way, or the last words of work that has ended."""

    work: Work | None = None
    last_words: str = ""
    failed: bool = False


STATE = State()


def start(label: str, steps: Steps, finish: Finish) -> None:
    """Begin. InputError while other work is under way."""
    if STATE.work:
        raise InputError(f"{STATE.work.label} is still under way: wait for its end, or cancel it")
    STATE.work, STATE.last_words = Work(label, steps, finish), ""
    bpy.app.timers.register(_look, first_interval=0.0, persistent=True)


def complete(label: str, steps: Steps, finish: Finish, on_status: Callable[[Status], None]) -> str:
    """Do all of it; returns the line of `finish`. InputError where it fails, or while other work is under way."""
    if STATE.work:
        raise InputError(f"{STATE.work.label} is still under way: wait for its end, or cancel it")
    while True:
        try:
            on_status(next(steps))
        except StopIteration as end:
            return finish(end.value)


def cancel(why: str = "Cancelled: finished runs are kept, and the next comparison goes on from there") -> None:
    """End the work under way, if any."""
    if STATE.work:
        STATE.work.steps.close()  # which ends the renderer
        _end(why, failed=False)
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)


def _look() -> float | None:
    """Take the steps that are ready; returns the seconds until the next look."""
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
    """Have the panel and the status bar drawn anew."""
    areas.redraw("PROPERTIES", "IMAGE_EDITOR")
    for window in bpy.context.window_manager.windows:
        if not window.modal_operators:  # which may show a text of their own there
            window.workspace.status_text_set(None)  # has the status bar drawn, which is none of the screen's areas


@bpy.app.handlers.persistent
def _on_load(*_: Any) -> None:
    """End the work under way: it belongs to the file that is being closed."""
    cancel("Cancelled, for another file was opened: finished runs are kept")


def register() -> None:
    """Nothing is under way."""
    bpy.app.handlers.load_pre.append(_on_load)


def unregister() -> None:
    """End the work under way."""
    cancel()
    STATE.last_words = ""
    bpy.app.handlers.load_pre.remove(_on_load)
