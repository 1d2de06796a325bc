"""`test_install.py` runs this script in a Blender with a window: `window_install.py ZIP FOLDER SCREENS PYTHON`.

It installs the zip and checks the environment by mouse and keyboard, in a window of 1600 x 1000 pixels. SCREENS gets the screenshots,
FOLDER/result.json the errors. PYTHON is the Python of a complete environment.
"""

import json
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import addon_utils  # pyright: ignore[reportMissingImports]  # a part of Blender
import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.blender.driving import Step, click, click_until, drive, run, screenshot, until

sys.path.pop(0)  # the add-on must use its own copy of the package

MODULE = "bl_ext.user_default.rl_guided"
ARCHIVE, FOLDER, SCREENS, PYTHON = map(Path, sys.argv[-4:])

# Places on the screen.
MENU = (960, 82)
SIDEBAR_ADDONS = (144, 291)
UNFOLD = (296, 106)
FILE_FOLDER = (760, 32)
FILE_NAME = (640, 614)
FILE_ACCEPT = (1135, 614)
CHECK, CHECK_BELOW_TWO_LINES = (623, 394), (623, 404)
FIRST_COPY = (945, 460)
ASIDE = (200, 560)
COMMAND = "/home/me/blender_rl_guiding/build.sh setup numba"


def enter(field: tuple[int, int], text: str, reached: Callable[[], object]) -> Iterator[Step]:
    """Type a text into a field, after a double click."""

    def act() -> Iterator[Step]:
        yield from click(field, times=2)
        yield from run("xdotool", "key", "ctrl+a")
        yield from run("xdotool", "type", "--delay", "15", text)
        yield from run("xdotool", "key", "Return")

    yield from until(reached, act)


def from_disk() -> Iterator[Step]:
    """Click the menu entry that opens the file browser."""
    yield from click(MENU)
    yield from run("xdotool", "key", "f")


def picture(name: str) -> Iterator[Step]:
    """A screenshot, with the mouse away from buttons."""
    yield from run("xdotool", "mousemove", *map(str, ASIDE))
    yield from screenshot(SCREENS / f"{name}.png")


def announce(python: Path) -> None:
    pointer = Path(os.environ["XDG_DATA_HOME"], "blender_rl_guiding", "python")
    pointer.parent.mkdir(parents=True, exist_ok=True)
    pointer.write_text(str(python))


def broken_python() -> Path:
    """A stand-in for a Python. Its answer names two faulty parts."""
    parts = [
        {"name": "Python", "version": "3.13.0"},
        {
            "name": "numba",
            "version": "0.62",
            "problem": "does not load: libllvmlite.so: version `GLIBCXX_3.4.32' not found",
            "command": COMMAND,
        },
        {"name": "torch", "problem": "not installed", "command": "./build.sh setup"},
    ]
    path = FOLDER / "broken python"
    path.write_text(f"#!/bin/sh\ncat <<'END'\n{json.dumps(parts)}\nEND\n")
    path.chmod(0o755)
    return path


def found() -> list[str]:
    """The faulty parts, once the check has ended."""
    operator = sys.modules[f"{MODULE}.preferences"].RLG_OT_check_environment
    return [part.name for part in operator.parts if part.problem] if operator.parts else ["none yet"]


def file_browser() -> Any:
    """The parameters of the open file dialogue, or None."""
    areas = [area for window in bpy.context.window_manager.windows for area in window.screen.areas if area.type == "FILE_BROWSER"]
    return areas[0].spaces.active.params if areas else None


def install() -> Iterator[Step]:
    bpy.ops.screen.userpref_show("INVOKE_DEFAULT", section="EXTENSIONS")
    yield from until(file_browser, from_disk)
    yield from enter(FILE_FOLDER, f"{ARCHIVE.parent}/", lambda: Path(os.fsdecode(file_browser().directory)) == ARCHIVE.parent)
    yield from enter(FILE_NAME, ARCHIVE.name, lambda: file_browser().filename == ARCHIVE.name)
    yield from picture("install-from-disk")
    yield from click_until(FILE_ACCEPT, lambda: MODULE in bpy.context.preferences.addons)


def unfolded() -> bool:
    (listed,) = [module for module in addon_utils.modules(refresh=False) if module.__name__ == MODULE]
    return addon_utils.module_bl_info(listed)["show_expanded"]


def steps() -> Iterator[Step]:
    yield 2.0
    yield from install()
    bpy.context.window_manager.addon_search = "RL Guided"
    yield from click_until(SIDEBAR_ADDONS, lambda: bpy.context.preferences.active_section == "ADDONS")
    yield from click_until(UNFOLD, unfolded)
    yield from picture("preferences-no-environment")
    yield from click_until(CHECK_BELOW_TWO_LINES, lambda: found() == ["Environment"])
    announce(broken_python())
    yield from click_until(CHECK, lambda: found() == ["numba", "torch"])
    yield from picture("preferences-broken")
    yield from click_until(FIRST_COPY, lambda: bpy.context.window_manager.clipboard == COMMAND)
    announce(PYTHON)
    yield from click_until(CHECK, lambda: found() == [])
    yield from picture("preferences-whole")


drive(steps(), FOLDER / "result.json", {})
