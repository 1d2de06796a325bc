"""Blender's panels with this engine, and panels for Cycles' settings. After the add-on is unregistered, all is as before."""

from collections.abc import Iterator

import bpy
import pytest

import addon
from addon import blender_panels, cycles_panels
from addon.engine import RLGuided
from tests.addon.layout import context, drawn

EXPECTED = {
    "render": ["RENDER_PT_color_management"],
    "output": ["RENDER_PT_format", "RENDER_PT_frame_range", "RENDER_PT_output", "RENDER_PT_encoding", "RENDER_PT_post_processing"],
    "view_layer": ["VIEWLAYER_PT_layer"],
    "world": ["WORLD_PT_context_world"],
    "material": ["EEVEE_MATERIAL_PT_context_material"],
    "data": ["DATA_PT_lens", "DATA_PT_camera_dof", "DATA_PT_camera", "DATA_PT_EEVEE_light", "DATA_PT_spot", "DATA_PT_context_mesh"],
    "object": ["OBJECT_PT_visibility"],
}


def engines() -> dict[str, set[str]]:
    return {panel.__name__: set(panel.COMPAT_ENGINES) for panel in bpy.types.Panel.__subclasses__() if hasattr(panel, "COMPAT_ENGINES")}


@pytest.fixture
def unregistered(scene: bpy.types.Scene) -> Iterator[None]:
    """Unregisters the add-on during a test."""
    addon.unregister()
    yield
    addon.register()


def test_the_panels_of_each_tab(scene: bpy.types.Scene):
    shown = {name for name, names in engines().items() if "RL_GUIDED" in names}
    assert shown.issuperset(name for names in EXPECTED.values() for name in names)
    assert not [name for name in shown if "freestyle" in name.lower() or name.startswith("CYCLES")]
    assert not shown & blender_panels._LEFT_OUT


def test_names_are_those_of_panels(scene: bpy.types.Scene):
    assert not blender_panels._TAKEN - set(engines())


def test_unregistering_takes_everything_back(unregistered: None):
    before = engines()
    assert not [name for name, names in before.items() if "RL_GUIDED" in names]
    addon.register()
    assert engines() != before
    addon.unregister()
    assert engines() == before
    assert not [name for name in dir(bpy.types) if name.startswith("RLG_")]
    assert not hasattr(bpy.types.Scene, "rl_guiding")
    assert not hasattr(bpy.types.WindowManager, "rl_guiding_coverage")


def visible(where: object) -> dict[str, list[str]]:
    """The properties and sockets in each panel for Cycles' settings, by tab and title."""
    found = {}
    for panel in cycles_panels._PANELS:
        if panel.poll(where):
            layout = drawn(panel, where)
            sockets = [one.socket.name for one in layout.drawn if one.kind == "node"]
            found[f"{panel.bl_context}: {panel.bl_label}"] = layout.names + sockets
    return found


def test_cycles_settings_that_are_taken_over(scene: bpy.types.Scene):
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    if bpy.app.version < (5, 0):
        lamp.data.use_nodes = True
    paint = bpy.data.materials.new("Paint")
    if bpy.app.version < (5, 0):
        paint.use_nodes = True
    names = visible(context(scene, object=lamp, light=lamp.data, world=scene.world, material=paint))
    assert names == {
        "material: Surface": ["Surface"],
        "world: Surface": ["Surface"],
        "data: Surface": ["Surface"],
        "render: Limits of the Scene": ["max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"],
        "render: Transparency and Roulette": ["transparent_max_bounces", "min_light_bounces"],
        "render: Film": ["film_exposure", "pixel_filter_type", "filter_width", "film_transparent"],
        "render: Simplify": ["simplify_subdivision_render", "simplify_child_particles_render"],
        "object: Ray Visibility": ["visible_camera", "visible_diffuse", "visible_glossy", "visible_transmission", "visible_shadow"],
        "data: Beam Shape": ["spread"],
        "data: Rays": ["use_shadow", "use_multiple_importance_sampling"],
        "world: Ray Visibility": ["camera", "diffuse", "glossy", "transmission"],
    }


def test_a_box_has_no_width(scene: bpy.types.Scene):
    scene.cycles.pixel_filter_type = "BOX"
    (panel,) = (panel for panel in cycles_panels._PANELS if panel.bl_label == "Film")
    assert drawn(panel, context(scene)).names == ["film_exposure", "pixel_filter_type", "film_transparent"]


def test_limits_of_the_scene_are_grey_where_the_settings_have_their_own(scene: bpy.types.Scene):
    where = context(scene, object=None, light=None, world=None, material=None)
    (panel,) = (panel for panel in cycles_panels._PANELS if panel.bl_label == "Limits of the Scene")
    for bounces, active in ((-1, True), (3, False)):
        scene.rl_guiding.max_bounces = bounces
        assert {one.active for one in drawn(panel, where).drawn} == {active}


def test_other_engines_keep_their_panels(scene: bpy.types.Scene):
    assert not visible(context(scene, "CYCLES", object=None, light=None, world=scene.world, material=None))


def test_materials_are_made_of_cycles_nodes(scene: bpy.types.Scene):
    assert RLGuided.bl_use_shading_nodes_custom is False
