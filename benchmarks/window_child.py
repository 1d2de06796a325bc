"""`window.py` runs this script in a Blender with a window: `window_child.py ENGINE PLACE PYTHON RESULT`.

It presses F12, notes each visit of the main thread for fifteen seconds, presses Esc, and writes the longest gap to RESULT.
"""

import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import addon
from addon import installation as environment
from tests.blender.driving import Step, drive

ENGINE, PLACE, PYTHON, RESULT = sys.argv[-4:]
BEAT = 0.02  # seconds between two visits of an idle main thread
SECONDS = 15.0
visits: list[float] = []
found: dict[str, Any] = {}


def visit() -> float:
    visits.append(time.monotonic())
    return BEAT


def steps() -> Iterator[Step]:
    yield 1.0
    bpy.app.timers.register(visit, persistent=True)
    bpy.ops.render.render("INVOKE_DEFAULT")
    yield SECONDS
    found["stall"] = max(after - before for before, after in pairwise(visits)) - BEAT
    assert bpy.app.is_job_running("RENDER"), "the render has ended by itself"
    pressed = time.monotonic()
    subprocess.Popen(["xdotool", "key", "Escape"])  # do not wait: Blender must go on to see the key
    yield lambda: not bpy.app.is_job_running("RENDER")
    found["esc"] = time.monotonic() - pressed


addon.register()
environment.python = lambda: Path(PYTHON)
bpy.context.preferences.view.render_display_type = PLACE
scene = bpy.context.scene
scene.render.engine = ENGINE
scene.rl_guiding.spp, scene.rl_guiding.guide = 100_000, "qtable"
scene.cycles.samples, scene.cycles.use_adaptive_sampling = 100_000, False
drive(steps(), Path(RESULT), found)
