"""Objects and render settings that the bundle does not take over are listed by name; faults are one line that names the object."""

import math
from collections.abc import Callable

import bpy
import numpy as np
import pytest

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import SceneData

Export = Callable[[], SceneData]
GREASE_PENCILS = "grease_pencils" if bpy.app.version >= (5, 0) else "grease_pencils_v3"


@pytest.fixture
def plane(scene: bpy.types.Scene) -> bpy.types.Object:
    bpy.ops.mesh.primitive_plane_add()
    return bpy.context.object


def lines(scene: SceneData) -> list[str]:
    return [f"{loss.object}, {loss.where}: {loss.detail}" for loss in scene.coverage]


@pytest.mark.parametrize(
    ("kind", "data"),
    [("hair curves", "hair_curves"), ("point cloud", "pointclouds"), ("volume", "volumes"), ("grease pencil", GREASE_PENCILS)],
)
def test_objects_that_are_not_surfaces(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, kind: str, data: str):
    scene.collection.objects.link(bpy.data.objects.new("Thing", getattr(bpy.data, data).new("Thing")))
    assert lines(run()) == [f"Thing, : {kind} is left out"]


def test_objects_that_do_not_render_are_not_listed(run: Export, plane: bpy.types.Object):
    bpy.ops.object.empty_add()
    bpy.ops.object.armature_add()
    bpy.ops.object.camera_add()
    bpy.ops.object.speaker_add()
    bpy.ops.curve.primitive_bezier_curve_add()
    assert lines(run()) == []


def test_hair(run: Export, plane: bpy.types.Object):
    plane.modifiers.new("Fur", "PARTICLE_SYSTEM")
    plane.particle_systems[0].settings.type = "HAIR"
    assert lines(run()) == ["Plane, particle system 'Fur': hair is left out"]


@pytest.mark.parametrize(
    ("switch", "value", "detail"),
    [
        ("is_holdout", True, "holdout: a normal surface stands in"),
        ("is_shadow_catcher", True, "shadow catcher: a normal surface stands in"),
    ],
)
def test_special_visibility(run: Export, plane: bpy.types.Object, switch: str, value: bool, detail: str):
    setattr(plane, switch, value)
    assert lines(run()) == [f"Plane, : {detail}"]


def test_held_out_collections(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    collection = bpy.data.collections.new("Special")
    scene.collection.children.link(collection)
    collection.objects.link(plane)
    scene.collection.objects.unlink(plane)
    scene.view_layers[0].layer_collection.children["Special"].holdout = True
    assert lines(run()) == ["Plane, : holdout: a normal surface stands in"]


def test_light_linking(run: Export, plane: bpy.types.Object):
    plane.light_linking.receiver_collection = bpy.data.collections.new("Receivers")
    assert lines(run()) == ["Plane, : light linking: lights everything"]


def test_shadow_terminators(run: Export, plane: bpy.types.Object):
    plane.cycles.shadow_terminator_geometry_offset = 0.25
    assert lines(run()) == []  # nothing to see on a flat surface
    plane.data.shade_smooth()
    plane.cycles.shadow_terminator_offset = 0.5
    settings = ("geometry offset 0.25: 0.1", "shading offset 0.5: 0")
    assert lines(run()) == [f"Plane, : shadow terminator, {setting} stands in" for setting in settings]


@pytest.mark.parametrize(("setting", "word"), [("use_multiview", "stereoscopy"), ("use_freestyle", "freestyle")])
def test_render_settings(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, setting: str, word: str):
    setattr(scene.render, setting, True)
    (line,) = lines(run())
    assert line.startswith(f"Scene, render settings: {word}: ")


@pytest.mark.parametrize(
    ("setting", "value", "word"),
    [
        ("caustics_reflective", False, "reflective caustics are off"),
        ("caustics_refractive", False, "refractive caustics are off"),
        ("use_fast_gi", True, "fast global illumination"),
    ],
)
def test_what_cycles_leaves_out(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, setting: str, value: bool, word: str):
    setattr(scene.cycles, setting, value)
    (line,) = lines(run())
    assert line.startswith(f"Scene, render settings: {word}: ")


def test_transparent_glass(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    scene.cycles.film_transparent_glass = True
    assert lines(run()) == []
    scene.render.film_transparent = True
    assert lines(run()) == ["Scene, render settings: transparent glass: the world is visible through glass"]


def test_culling_works_with_simplify_alone(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    scene.cycles.use_camera_cull = scene.cycles.use_distance_cull = True
    assert lines(run()) == []
    scene.render.use_simplify = True
    assert [line.split(": ")[1] for line in lines(run())] == ["camera culling", "distance culling"]


def test_overrides_of_the_view_layer(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    scene.view_layers[0].material_override = bpy.data.materials.new("Clay")
    assert lines(run()) == ["Scene, view layer 'ViewLayer': material override: not applied"]


def test_motion_blur_of_what_moves(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    scene.render.use_motion_blur = True
    assert lines(run()) == []
    plane.keyframe_insert("location")
    assert lines(run()) == ["Scene, render settings: motion blur: everything stands still at the frame's own time"]


@pytest.mark.parametrize(
    ("kind", "panorama", "name"), [("PANO", "FISHEYE_EQUISOLID", "FISHEYE_EQUISOLID"), ("CUSTOM", "EQUIRECTANGULAR", "CUSTOM")]
)
def test_cameras(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, kind: str, panorama: str, name: str):
    scene.camera.data.type, scene.camera.data.panorama_type = kind, panorama
    assert lines(run()) == [f"Camera, camera: type {name}: a perspective camera of 50 mm stands in"]


def test_triangles_without_area_are_left_out(run: Export, plane: bpy.types.Object):
    mesh = bpy.data.meshes.new("Pole")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 0), (2, 0, 0)], [], [(0, 1, 2, 3), (0, 1, 4)])
    plane.data = mesh
    scene = run()
    assert len(scene.triangles) == 1
    assert lines(scene) == ["Plane, mesh: 2 triangle(s) without area are left out"]


@pytest.mark.parametrize("value", [math.nan, math.inf, 3e38])
def test_a_vertex_that_is_not_finite_is_a_fault(run: Export, plane: bpy.types.Object, value: float):
    positions = np.zeros(12, np.float32)
    plane.data.vertices.foreach_get("co", positions)
    positions[7] = value
    plane.data.vertices.foreach_set("co", positions)
    with pytest.raises(InputError, match=rf"^Scene: object 'Plane': vertex 2 is out of range: \(-1, {value:g}, 0\)$".replace("+", r"\+")):
        run()


def test_a_transform_that_is_not_finite_is_a_fault(run: Export, plane: bpy.types.Object):
    plane.location.x = math.nan
    with pytest.raises(InputError, match=r"^Scene: object 'Plane': its transform is not finite$"):
        run()


def test_an_empty_scene_is_a_fault(run: Export):
    with pytest.raises(InputError, match=r"^Scene: the scene is empty: no triangles$"):
        run()


def test_a_dark_scene_is_a_fault(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    scene.world = None
    with pytest.raises(InputError, match=r"^Scene: the scene has no light: no lamp, no emitting surface, and the world is black$"):
        run()
    bpy.ops.object.light_add(type="SUN")
    assert [lamp.name for lamp in run().lamps] == ["Sun"]
