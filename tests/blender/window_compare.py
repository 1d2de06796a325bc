"""`test_windows.py` runs this script in a Blender with a window: `window_compare.py SCREENS RESULT PYTHON`.

It compares two methods by the panel's button during a render, and notes the results. It picks a point and shows Q at this point. Then it
compares with Cycles, saves and reloads. RESULT gets the findings, SCREENS the screenshots.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import addon
from addon import cycles_panels, panels
from addon import installation as environment
from addon.comparison import running
from addon.comparison.panels import RLG_PT_compare, RLG_PT_compare_method
from tests.blender.driving import Step, click_until, drawn, drive, escape_until, run, screenshot

SCREENS, RESULT, PYTHON = map(Path, sys.argv[-3:])
BUTTON, SPHERE = (1570, 721), (698, 815)  # on the screen
found: dict[str, Any] = {}
under_way: list[float] = []  # shares of the comparison that the panel was drawn with, during a render by Blender


def note_share() -> None:
    """Note the share, then redraw. A busy machine may not look again before the comparison ends."""
    if rendering() and running.STATE.work and running.STATE.work.status.share > 0:
        under_way.append(running.STATE.work.status.share)
    _redraw()


_redraw, running.redraw = running.redraw, note_share


def comparison() -> Any:
    return bpy.context.scene.rl_guiding_comparison


def window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def rendering() -> bool:
    return bpy.app.is_job_running("RENDER")


def idle() -> bool:
    return running.STATE.work is None


def ended() -> str:
    assert not running.STATE.failed, running.STATE.last_words
    return running.STATE.last_words


def arrange() -> Iterator[Step]:
    """Show a tall Properties editor with the Render tab, and the viewport through the camera."""
    for kind in ("OUTLINER", "DOPESHEET_EDITOR"):
        area = next(area for area in window().screen.areas if area.type == kind)
        with bpy.context.temp_override(window=window(), area=area):
            bpy.ops.screen.area_close()
        yield from drawn()
    for area in window().screen.areas:
        if area.type == "PROPERTIES":
            area.spaces.active.context = "RENDER"
        if area.type == "VIEW_3D":
            area.spaces.active.region_3d.view_perspective = "CAMERA"


def compare() -> Iterator[Step]:
    """Compare by the panel's button, beside a render by Blender."""
    yield from screenshot(SCREENS / "compare.png")
    yield from click_until(BUTTON, lambda: not idle())
    bpy.ops.render.render("INVOKE_DEFAULT")
    yield lambda: under_way
    yield from screenshot(SCREENS / "compare-under-way.png")
    yield idle
    found["beside"] = "a render went on" if rendering() else "no render"
    yield from escape_until(lambda: not rendering())
    found["words"] = ended()
    yield from screenshot(SCREENS / "compare-done.png")
    rows = comparison().results
    found["results"], found["ratio"] = [row.name for row in rows], rows[1].mape_display / rows[0].mape_display


def look() -> Iterator[Step]:
    for kind in ("IMAGES", "ERRORS", "PICTURES"):
        with bpy.context.temp_override(window=window()):
            bpy.ops.rl_guided.side_by_side(kind=kind)
        yield from screenshot(SCREENS / f"compare-{kind.lower()}.png")
    with bpy.context.temp_override(window=window()):
        bpy.ops.rl_guided.to_slots()
    found["slots"] = [slot.name for slot in bpy.data.images["Render Result"].render_slots if slot.name in {"reference", *found["results"]}]
    window().workspace = bpy.data.workspaces["Layout"]
    yield from drawn()


def learnt() -> Iterator[Step]:
    """Pick a point by a click into the viewport, and show Q there."""
    with bpy.context.temp_override(window=window()):
        bpy.ops.rl_guided.pick("INVOKE_DEFAULT")
    yield from click_until(SPHERE, lambda: comparison().use_probe)
    found["probe"] = list(comparison().probe)
    comparison().active_method = 1
    bpy.ops.rl_guided.inspect()
    yield idle
    found["inspected"] = ended()
    area = max(window().screen.areas, key=lambda area: area.width * area.height)
    area.type = "IMAGE_EDITOR"
    area.spaces.active.image = bpy.data.images[found["inspected"].split("'")[1]]
    yield from screenshot(SCREENS / "compare-learnt.png")


def with_cycles() -> Iterator[Step]:
    comparison().reference, comparison().reference_spp = "CYCLES", 64
    bpy.ops.rl_guided.compare()
    yield idle
    ended()
    found["reference"] = comparison().about


def reopen() -> Iterator[Step]:
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    yield from drawn()
    images = [image for row in comparison().results for image in (row.image, row.heat)]
    found["reopened"] = [image.name for image in images if image.size[0] and image.filepath.startswith("//")]


def steps() -> Iterator[Step]:
    bpy.ops.wm.save_as_mainfile(filepath=str(RESULT.parent / "scene" / "c1.blend"))
    for name in ("uniform", "qtable"):
        bpy.ops.rl_guided.method_add(name=name)
    comparison().spp, comparison().reference_spp, comparison().use_probe = 32, 32, False
    yield from arrange()
    yield from compare()
    yield from look()
    yield from learnt()
    yield from with_cycles()
    yield from reopen()
    yield from run("xdotool", "mousemove", "500", "700")
    yield from screenshot(SCREENS / "compare-reopened.png")


for panel in (*panels._PANELS, *cycles_panels._PANELS):
    panel.bl_options = {"DEFAULT_CLOSED"}
RLG_PT_compare.bl_options = RLG_PT_compare_method.bl_options = set()
addon.register()
environment.python = lambda: PYTHON
bpy.context.preferences.view.render_display_type = "NONE"
scene = bpy.context.scene
scene.render.engine = "RL_GUIDED"
scene.render.resolution_percentage = 50
scene.rl_guiding.spp = 100_000
scene.rl_guiding.guide = "bsdf"
drive(steps(), RESULT, found)
