"""Runs a script in a Blender with a window. The script is a generator; a timer runs its steps, so Blender is not blocked."""

import faulthandler
import json
import subprocess
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy

from tests.patience import PATIENCE

Step = float | Callable[[], object]  # seconds to wait, or a condition to wait for
LOOK = 0.1  # seconds between two checks of a condition
TRY_AGAIN = 200  # number of checks before a click counts as lost


def run(*command: str) -> Iterator[Step]:
    """Run a program while Blender goes on, then give Blender time to see the effect."""
    child = subprocess.Popen(command)
    yield lambda: child.poll() is not None
    assert child.returncode == 0, command
    yield 0.4


def drawn() -> Iterator[Step]:
    """Wait until all windows are laid out and drawn with the current data."""
    yield LOOK  # gives changes time to reach the windows
    for window in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=window):
            bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
    yield LOOK


def until(reached: Callable[[], object], act: Callable[[], Iterator[Step]]) -> Iterator[Step]:
    """Act until the condition holds. Acting again is needed, because a busy computer may draw a button after the click."""
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
    """Click the left button at a pixel, counted from the screen's top left corner."""
    yield from run("xdotool", "mousemove", *map(str, place))
    yield from run("xdotool", "click", "--repeat", str(times), "--delay", "80", "1")


def click_until(place: tuple[int, int], reached: Callable[[], object]) -> Iterator[Step]:
    """Click until the condition holds."""
    yield from until(reached, lambda: click(place))


def escape_until(reached: Callable[[], object]) -> Iterator[Step]:
    """Press Esc until the condition holds."""

    def press() -> Iterator[Step]:
        subprocess.Popen(["xdotool", "key", "Escape"])  # do not wait: Blender must go on to see the key
        yield LOOK

    yield from until(reached, press)


def screenshot(path: Path) -> Iterator[Step]:
    """Save the whole screen as a PNG."""
    yield from drawn()
    yield from run("import", "-window", "root", str(path))


def drive(steps: Iterator[Step], result: Path, found: dict[str, Any]) -> None:
    """Take the steps, write the findings as JSON, with a traceback as "fault" if there is one, and quit."""
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
        except Exception:  # noqa: BLE001  # the test must read any exception
            found["fault"] = traceback.format_exc()
            subprocess.run(["import", "-window", "root", str(result.with_suffix(".png"))], check=False)
        result.write_text(json.dumps(found))
        bpy.ops.wm.quit_blender()
        return None

    faulthandler.enable()  # shows the place if Blender itself crashes
    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
