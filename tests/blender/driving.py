"""Leads a Blender with a window through a script: steps of a generator, taken by a timer, so that Blender goes on meanwhile."""

import faulthandler
import json
import subprocess
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy

Step = float | Callable[[], object]  # seconds to wait, or what must become true
PATIENCE = 90.0  # seconds for each thing that is waited for
LOOK = 0.1  # seconds between two looks


def run(*command: str) -> Iterator[Step]:
    """A program that needs Blender to go on meanwhile, and then time for Blender to see what it did."""
    child = subprocess.Popen(command)
    yield lambda: child.poll() is not None
    assert child.returncode == 0, command
    yield 0.4


def click(place: tuple[int, int], times: int = 1) -> Iterator[Step]:
    """The left button, at pixels of the screen from its top left corner."""
    yield from run("xdotool", "mousemove", *map(str, place))
    yield from run("xdotool", "click", "--repeat", str(times), "--delay", "80", "1")


def screenshot(path: Path) -> Iterator[Step]:
    """The whole screen, as a PNG."""
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
