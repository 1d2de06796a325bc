"""`test_windows.py` runs this script in a Blender with a window: `window_panels.py SCREENS RESULT PYTHON`.

It draws every panel for every guide and encoder, checks the scene and applies presets. SCREENS gets the screenshots, RESULT the
findings as JSON. Panels that fail to draw print on stderr.
"""

import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import addon
from addon import cycles_panels, panels, presets
from addon.coverage.losses import tell
from tests.blender import driving
from tests.blender.driving import Step, drawn

SCREENS, RESULT, _ = map(Path, sys.argv[-3:])
SETTLED = 1.5  # seconds until panels stop moving, for screenshots
found: dict[str, Any] = {}


def windows() -> tuple[bpy.types.Window, list[bpy.types.Area]]:
    """(window, its Properties editors from left to right)."""
    window = bpy.context.window_manager.windows[0]
    editors = [area for area in window.screen.areas if area.type == "PROPERTIES"]
    return window, sorted(editors, key=lambda area: area.x)


def arrange() -> None:
    """Make three Properties editors of the viewport, beside the usual one."""
    window, _ = windows()
    for factor in (1 / 3, 1 / 2):
        widest = max(window.screen.areas, key=lambda area: area.width * area.height)
        with bpy.context.temp_override(window=window, area=widest, region=widest.regions[-1]):
            bpy.ops.screen.area_split(direction="VERTICAL", factor=factor)
    for area in [area for area in window.screen.areas if area.type == "VIEW_3D"]:
        area.type = "PROPERTIES"


def show(*tabs: str) -> Iterator[Step]:
    """Show these tabs in the Properties editors, and draw them."""
    for area, tab in zip(windows()[1], tabs, strict=False):
        area.spaces.active.context = tab
        area.tag_redraw()
    yield from drawn()


def screenshot(name: str) -> Iterator[Step]:
    return driving.screenshot(SCREENS / f"panels-{name}.png")


def in_editor(which: int) -> Any:
    """The context of one of the Properties editors."""
    window, editors = windows()
    return bpy.context.temp_override(window=window, area=editors[which], region=editors[which].regions[-1])


def rendered() -> bytes:
    """The render result as a PNG."""
    path = RESULT.with_suffix(".png")
    bpy.data.images["Render Result"].save_render(str(path))
    return path.read_bytes()


def check_scene(scene: bpy.types.Scene) -> Iterator[Step]:
    """Render by Cycles, then run Check Scene: the render result must stay."""
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_percentage = 10
    bpy.ops.render.render()
    before = rendered(), bpy.data.is_dirty, len(bpy.data.scenes), len(bpy.data.images)
    scene.render.engine = "RL_GUIDED"
    yield from show("RENDER", "RENDER", "RENDER")
    with in_editor(1):
        bpy.ops.rl_guided.check()
    found["unchanged"] = before == (rendered(), bpy.data.is_dirty, len(bpy.data.scenes), len(bpy.data.images))
    shown = bpy.context.window_manager.rl_guiding_coverage
    found["losses"] = [line.object for line in shown.losses]
    shown.active = found["losses"].index("Left")
    found["active"] = bpy.context.view_layer.objects.active.name
    scene.render.resolution_percentage = 100


def told_by_a_thread() -> Iterator[Step]:
    """Fill the list from another thread, as an engine does."""
    losses = bpy.context.window_manager.rl_guiding_coverage.losses
    kept = [line.loss for line in losses]
    for told in (kept[1:], kept):
        thread = threading.Thread(target=tell, args=("c1", told))
        thread.start()
        thread.join()
        yield lambda told=told: len(losses) == len(told)
    bpy.context.window_manager.rl_guiding_coverage.active = 0


def every_variant(settings: bpy.types.PropertyGroup) -> Iterator[Step]:
    """Draw each guide and each encoder."""
    for guide in settings.bl_rna.properties["guide"].enum_items:
        settings.guide = guide.identifier
        yield from show("RENDER", "RENDER", "RENDER")
    settings.guide = "dqn"
    for encoder in settings.guide_dqn.bl_rna.properties["encoder"].enum_items:
        settings.guide_dqn.encoder = encoder.identifier
        yield from show("RENDER", "RENDER", "RENDER")


def presets_and_undo() -> Iterator[Step]:
    bpy.context.scene.rl_guiding.guide = "bsdf"
    yield from show("RENDER", "RENDER", "DATA", "RENDER")
    yield SETTLED
    yield from screenshot("coverage")
    presets.add(bpy.context.scene, "My preset")
    with in_editor(1):
        bpy.ops.ed.undo_push(message="before")
        bpy.ops.rl_guided.preset_apply("EXEC_DEFAULT", True, name="recommended")
    found["applied"] = bpy.context.scene.rl_guiding.guide
    with in_editor(1):
        bpy.ops.ed.undo()
    found["undone"] = bpy.context.scene.rl_guiding.guide
    with in_editor(1):
        bpy.ops.rl_guided.preset_apply("EXEC_DEFAULT", True, name="recommended")
        bpy.ops.wm.call_panel(name="RLG_PT_presets", keep_open=True)
    yield SETTLED
    yield from screenshot("presets")


def shader_editor() -> Iterator[Step]:
    """Edit materials, and add nodes."""
    area = windows()[1][0]
    area.ui_type = "ShaderNodeTree"
    yield from drawn()
    region = next(region for region in area.regions if region.type == "WINDOW")
    found["edited"] = area.spaces.active.edit_tree is not None
    with bpy.context.temp_override(window=windows()[0], area=area, region=region):
        bpy.ops.node.add_node(type="ShaderNodeBsdfGlossy")
        bpy.ops.wm.call_menu(name="NODE_MT_shader_node_add_all")
    yield from drawn()
    yield from screenshot("nodes")


def steps() -> Iterator[Step]:
    arrange()
    scene = bpy.context.scene
    fog = bpy.data.objects.new("Morning fog", bpy.data.volumes.new("Fog"))
    scene.collection.objects.link(fog)
    red = bpy.data.objects["Left"].material_slots[0].material.node_tree
    diffuse = next(node for node in red.nodes if node.type == "BSDF_DIFFUSE")
    red.links.new(red.nodes.new("ShaderNodeTexVoronoi").outputs["Color"], diffuse.inputs["Color"])
    yield from drawn()
    yield from check_scene(scene)
    yield from told_by_a_thread()
    yield from every_variant(scene.rl_guiding)
    scene.rl_guiding.guide_dqn.encoder = "frequency"
    scene.rl_guiding.guide_dqn.schedule = "cosine"
    yield from show("RENDER", "OUTPUT", "MATERIAL", "WORLD")
    yield from screenshot("render")
    bpy.ops.object.light_add(type="AREA")
    yield from show("OBJECT", "DATA", "VIEW_LAYER", "RENDER")
    yield from screenshot("light")
    bpy.context.view_layer.objects.active = bpy.data.objects["Camera"]
    yield from show("RENDER", "RENDER", "DATA", "RENDER")
    yield from screenshot("camera")
    yield from presets_and_undo()
    bpy.context.view_layer.objects.active = bpy.data.objects["Left"]
    yield from shader_editor()


for panel in (*panels._PANELS, *cycles_panels._PANELS):
    panel.bl_options = set()  # draw panels that start closed, too
addon.register()
driving.drive(steps(), RESULT, found)
