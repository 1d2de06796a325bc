"""Leads a Blender with a window through a script: steps of a generator, taken by a timer, so that Blender goes on meanwhile."""

import faulthandler
import json
import subprocess
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy

from tests.patience import PATIENCE

Step = float | Callable[[], object]  # seconds to wait, or what must become true
LOOK = 0.1  # seconds between two looks
TRY_AGAIN = 200  # looks before a click is taken for lost


def run(*command: str) -> Iterator[Step]:
    """A program that needs Blender to go on meanwhile, and then time for Blender to see what it did."""
    child = subprocess.Popen(command)
    yield lambda: child.poll() is not None
    assert child.returncode == 0, command
    yield 0.4


def drawn() -> Iterator[Step]:
    """All windows are laid out and drawn as the data is now, however long that takes."""
    yield LOOK  # what was changed is told to the windows first
    for window in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=window):
            bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
    yield LOOK


def until(reached: Callable[[], object], act: Callable[[], Iterator[Step]]) -> Iterator[Step]:
    """Act, and act again where it was in vain: a busy computer may draw a button after the click that was meant for it."""
    tries = int(PATIENCE / (TRY_AGAIN * LOOK))
    for _ in range(tries):
        yield from drawn()
        yield from act()
        for _ in range(TRY_AGAIN):
            if reached():
                return
            yield LOOK
    raise AssertionError(f"in vain, {tries} times: line {reached.__code__.co_firstlineno}")


def click(place: tuple[int, int], times: int = 1) -> Iterator[Step]:
    """The left button, at pixels of the screen from its top left corner."""
    yield from run("xdotool", "mousemove", *map(str, place))
    yield from run("xdotool", "click", "--repeat", str(times), "--delay", "80", "1")


def click_until(place: tuple[int, int], reached: Callable[[], object]) -> Iterator[Step]:
    """A click, and what it must bring about."""
    yield from until(reached, lambda: click(place))


def escape_until(reached: Callable[[], object]) -> Iterator[Step]:
    """The key Esc, and what it must bring about."""

    def press() -> Iterator[Step]:
        subprocess.Popen(["xdotool", "key", "Escape"])  # not waited for: Blender has to go on to see it
        yield LOOK

    yield from until(reached, press)


def screenshot(path: Path) -> Iterator[Step]:
    """The whole screen as it is now, as a PNG."""
    yield from drawn()
    yield from run("import", "-window", "root", str(path))


def drive(steps: Iterator[Step], result: Path, found: dict[str, Any]) -> None:
    """Go through the steps, write what was found as JSON, with the traceback as "fault" if there was one, and quit."""
    waited, wanted = 0.0, None

    def tick() -> float | None:
        nonlocal waited, wanted
        try:
            if wanted and not wanted():
                waited += LOOK
                assert waited < PATIENCE, f"waited in vain for line {wanted.__code__.co_firstlineno}"
                return LOOK
            step = next(steps)
            waited, wanted = 0.0, None if isinstance(step, float) else step
            return step if isinstance(step, float) else LOOK
        except StopIteration:
            pass
        except Exception:  # noqa: BLE001  # whatever it is, the test must read it
            found["fault"] = traceback.format_exc()
            subprocess.run(["import", "-window", "root", str(result.with_suffix(".png"))], check=False)
        result.write_text(json.dumps(found))
        bpy.ops.wm.quit_blender()
        return None

    faulthandler.enable()  # says where, should Blender itself crash
    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
