"""The coverage report in the panel: Check Scene and renders fill it, and each line leads to its object."""

from collections.abc import Callable
from pathlib import Path

import bpy
import pytest

from addon.coverage import losses, panel
from addon.coverage.check import check
from blender_rl_guiding.scene.chance import DETAIL
from blender_rl_guiding.scene.description import Loss
from tests.addon.layout import Layout, context, drawn

FOG, FREESTYLE = Loss("Fog", "", "volume is left out"), Loss("Scene", "render settings", "freestyle: lines are left out")


@pytest.fixture
def foggy(scene: bpy.types.Scene) -> bpy.types.Scene:
    """A scene with a plane, a volume and Freestyle, for this engine."""
    bpy.ops.mesh.primitive_plane_add()
    scene.collection.objects.link(bpy.data.objects.new("Fog", bpy.data.volumes.new("Fog")))
    scene.render.use_freestyle = True
    scene.render.engine = "RL_GUIDED"
    return scene


def listed() -> list[Loss]:
    return [line.loss for line in bpy.context.window_manager.rl_guiding_coverage.losses]


def panel_of(scene: bpy.types.Scene) -> Layout:
    return drawn(panel.RLG_PT_coverage, context(scene))


def test_check_scene_lists_losses(foggy: bpy.types.Scene):
    assert panel_of(foggy).texts == ["", "Not checked yet"]
    assert bpy.ops.rl_guided.check() == {"FINISHED"}
    assert listed() == [FREESTYLE, FOG]
    assert panel_of(foggy).texts[-1] == "Scene: 2 things replaced or left out"


def test_check_scene_lists_lamps_that_are_left_to_chance(foggy: bpy.types.Scene):
    bpy.ops.object.light_add(type="POINT", location=(0, 0, 9))
    bpy.context.object.name, bpy.context.object.data.shadow_soft_size = "Bulb", 0.01
    assert check(foggy)[0] == (FREESTYLE, FOG)
    foggy.rl_guiding.nee = False
    assert check(foggy)[0] == (FREESTYLE, FOG, Loss("Bulb", "", DETAIL))


def test_check_scene_tells_what_makes_it_impossible(scene: bpy.types.Scene):
    scene.render.engine = "RL_GUIDED"
    bpy.ops.rl_guided.check()
    assert [loss.detail for loss in listed()] == ["the scene is empty: nothing but the world is in the image"]
    scene.camera = None
    bpy.ops.rl_guided.check()
    assert "camera" in panel_of(scene).texts[-1].lower()


def test_check_scene_sees_what_renders_see(foggy: bpy.types.Scene):
    foggy.render.use_freestyle = False
    bpy.data.objects["Fog"].hide_render = True
    assert check(foggy) == ((), "")
    bpy.data.objects["Fog"].hide_render = False
    bpy.data.objects["Fog"].hide_viewport = True
    assert check(foggy) == ((FOG,), "")


def test_check_scene_changes_nothing(foggy: bpy.types.Scene, tmp_path: Path):
    """Check Scene reads other frames, and yet changes nothing."""
    foggy.render.use_motion_blur = True
    bpy.data.objects["Plane"].driver_add("location", 0).driver.expression = "frame"
    foggy.frame_set(5)
    foggy.render.engine = "CYCLES"
    foggy.cycles.samples = 1
    bpy.ops.render.render()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "foggy.blend"))

    def state() -> tuple:
        bpy.data.images["Render Result"].save_render(str(tmp_path / "result.png"))
        kinds = (bpy.data.scenes, bpy.data.objects, bpy.data.images, bpy.data.collections, bpy.data.worlds)
        blocks = [(block.name, block.users) for kind in kinds for block in kind]
        time = foggy.frame_current, foggy.frame_subframe, bpy.data.objects["Plane"].matrix_world.translation.x
        return time, blocks, bpy.data.is_dirty, (tmp_path / "result.png").read_bytes(), foggy.render.engine

    before = state()
    assert [loss.object for loss in check(foggy)[0]] == ["Scene", "Fog", "Plane"]
    assert state() == before
    assert bpy.app.version < (5, 0) or before[2] is False  # before 5.0 the bpy module reports every file as changed


def test_check_scene_is_no_render_to_others(foggy: bpy.types.Scene):
    heard = []

    def handler(*_: object) -> None:
        heard.append(1)

    handlers = [getattr(bpy.app.handlers, name) for name in ("render_init", "render_pre", "render_post", "render_complete")]
    for one in handlers:
        one.append(handler)
    check(foggy)
    assert not heard
    foggy.render.engine = "RL_GUIDED_TEST"
    bpy.ops.render.render()
    assert len(heard) == len(handlers)
    for one in handlers:
        one.remove(handler)


def test_the_checker_cannot_be_chosen(foggy: bpy.types.Scene):
    check(foggy)
    with pytest.raises(TypeError):
        foggy.render.engine = "RL_GUIDED_CAPTURE"


def test_another_file_forgets(foggy: bpy.types.Scene):
    bpy.ops.rl_guided.check()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert listed() == []
    assert bpy.context.window_manager.rl_guiding_coverage.scene == ""


def test_renders_tell(scene: bpy.types.Scene):
    losses.tell("Scene", [FOG])
    assert listed() == [FOG]
    losses.tell("Scene", [], fault="no light")
    assert listed() == []
    assert panel_of(scene).texts[-1] == "no light"


def test_a_click_selects_the_object(foggy: bpy.types.Scene):
    losses.tell("Scene", [FREESTYLE, FOG])
    bpy.context.window_manager.rl_guiding_coverage.active = 1
    assert bpy.context.selected_objects == [bpy.data.objects["Fog"]]
    assert bpy.context.view_layer.objects.active == bpy.data.objects["Fog"]
    texts = panel_of(foggy).texts
    assert texts[:2] == ["Fog", "volume is left out"]


def test_a_click_can_be_undone(foggy: bpy.types.Scene):
    losses.tell("Scene", [FOG])
    bpy.ops.ed.undo_push(message="before")
    bpy.context.window_manager.rl_guiding_coverage.active = 0
    bpy.ops.ed.undo()
    assert [thing.name for thing in bpy.context.selected_objects] == ["Plane"]


def test_a_click_shows_the_material_and_its_node(foggy: bpy.types.Scene, new_material: Callable[[str], bpy.types.Material]):
    plane, paint = bpy.data.objects["Plane"], new_material("Paint")
    plane.data.materials.append(new_material("Other"))
    plane.data.materials.append(paint)
    node = paint.node_tree.nodes.new("ShaderNodeTexVoronoi")
    losses.tell("Scene", [Loss("Plane", f"material 'Paint', node '{node.name}', socket 'Color'", "not supported")])
    bpy.context.window_manager.rl_guiding_coverage.active = 0
    assert plane.active_material == paint
    assert paint.node_tree.nodes.active == node
    assert [one.name for one in paint.node_tree.nodes if one.select] == [node.name]


def test_a_click_shows_the_node_of_the_world(foggy: bpy.types.Scene):
    if bpy.app.version < (5, 0):
        foggy.world.use_nodes = True
    node = foggy.world.node_tree.nodes.new("ShaderNodeTexSky")
    losses.tell("Scene", [Loss("World", f"node '{node.name}'", "not supported")])
    bpy.context.window_manager.rl_guiding_coverage.active = 0
    assert foggy.world.node_tree.nodes.active == node


@pytest.mark.parametrize("name", ["Gone", "Elsewhere", "Hidden"])
def test_what_cannot_be_selected_is_said(foggy: bpy.types.Scene, name: str, capfd: pytest.CaptureFixture):
    thing = bpy.data.objects.new("Gone later" if name == "Gone" else name, None)
    if name == "Hidden":
        foggy.collection.objects.link(thing)
        thing.hide_set(True)
    losses.tell("Scene", [Loss(name, "", "left out")])
    bpy.context.window_manager.rl_guiding_coverage.active = 0
    said = {"Gone": "is not there any more", "Elsewhere": "is not in this view layer", "Hidden": "is only made active"}
    assert f"'{name}'" in (out := capfd.readouterr().out)
    assert said[name] in out
