"""`test_windows.py` runs this script in a Blender with a window: `window_first.py SCREENS RESULT PYTHON`.

It renders the start-up file by F12, then by Cycles. Only the engine and a small image size are set. The EXR files are beside RESULT.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import addon
from addon import installation as environment
from addon.cycles_reference import prepare
from tests.blender.driving import Step, drive, screenshot
from tests.system.first_pictures import REFERENCE_SPP, SPP, render

SCREENS, RESULT, PYTHON = map(Path, sys.argv[-3:])
done: list[str] = []


def steps() -> Iterator[Step]:
    scene = bpy.context.scene
    scene.render.resolution_percentage = 5
    scene.render.engine = "RL_GUIDED"
    bpy.ops.render.render("INVOKE_DEFAULT")
    yield lambda: done
    yield from screenshot(SCREENS / "first.png")
    prepare(scene, SPP)  # `prepare` also makes Blender save images unchanged
    bpy.data.images["Render Result"].save_render(str(RESULT.with_name("ours.exr")), scene=scene)
    render(scene, RESULT.with_name("cycles.exr"), SPP, seed=0)
    render(scene, RESULT.with_name("reference.exr"), REFERENCE_SPP, seed=1_000_000)


addon.register()
environment.python = lambda: PYTHON
bpy.app.handlers.render_complete.append(lambda *_: done.append("complete"))
bpy.context.preferences.view.render_display_type = "AREA"
drive(steps(), RESULT, {})
