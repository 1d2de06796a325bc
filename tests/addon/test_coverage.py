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


def lamp(kind: str, energy: float = 10.0) -> bpy.types.Object:
    bpy.ops.object.light_add(type=kind)
    bpy.context.object.data.energy = energy
    bpy.context.object.name = kind
    return bpy.context.object


def lines(scene: SceneData) -> list[str]:
    return [f"{loss.object}, {loss.where}: {loss.detail}" for loss in scene.coverage]


@pytest.mark.parametrize("kind", ["POINT", "SUN", "SPOT", "AREA"])
def test_lamps(run: Export, plane: bpy.types.Object, kind: str):
    lamp(kind)
    assert lines(run()) == [f"{kind}, : {kind.lower()} lamp is left out: lamps are not supported yet"]


def test_a_lamp_that_is_off_is_not_listed(run: Export, plane: bpy.types.Object):
    lamp("POINT", 0.0)
    lamp("SUN").data.color = (0, 0, 0)
    lamp("SPOT").hide_render = True
    assert lines(run()) == []


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
        ("visible_camera", False, "ray visibility: visible to camera rays, although switched off"),
        ("visible_diffuse", False, "ray visibility: visible to diffuse rays, although switched off"),
        ("visible_shadow", False, "ray visibility: visible to shadow rays, although switched off"),
        ("is_holdout", True, "holdout: a normal surface stands in"),
        ("is_shadow_catcher", True, "shadow catcher: a normal surface stands in"),
    ],
)
def test_special_visibility(run: Export, plane: bpy.types.Object, switch: str, value: bool, detail: str):
    setattr(plane, switch, value)
    assert lines(run()) == [f"Plane, : {detail}"]


@pytest.mark.parametrize(("switch", "word"), [("holdout", "holdout"), ("indirect_only", "indirect only")])
def test_special_collections(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, switch: str, word: str):
    collection = bpy.data.collections.new("Special")
    scene.collection.children.link(collection)
    collection.objects.link(plane)
    scene.collection.objects.unlink(plane)
    setattr(scene.view_layers[0].layer_collection.children["Special"], switch, True)
    (line,) = lines(run())
    assert line.startswith(f"Plane, : {word}:")


def test_light_linking(run: Export, plane: bpy.types.Object):
    plane.light_linking.receiver_collection = bpy.data.collections.new("Receivers")
    assert lines(run()) == ["Plane, : light linking: lights everything"]


@pytest.mark.parametrize(
    ("setting", "word"),
    [("use_border", "region"), ("use_multiview", "stereoscopy"), ("film_transparent", "transparent"), ("use_freestyle", "freestyle")],
)
def test_render_settings(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, setting: str, word: str):
    setattr(scene.render, setting, True)
    (line,) = lines(run())
    assert line.startswith("Scene, render settings: ")
    assert word in line


def test_film_exposure(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    scene.cycles.film_exposure = 2
    assert lines(run()) == ["Scene, render settings: film exposure 2: the image is not multiplied"]


def test_motion_blur_of_what_moves(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    scene.render.use_motion_blur = True
    assert lines(run()) == []
    plane.keyframe_insert("location")
    assert lines(run()) == ["Scene, render settings: motion blur: everything stands still at the frame's own time"]


@pytest.mark.parametrize(
    ("change", "detail"),
    [
        ({"type": "ORTHO"}, "type ORTHO: a perspective camera of 50 mm stands in"),
        ({"shift_x": 0.25}, "shift (0.25, 0): the image is centred"),
        ({"dof.use_dof": True}, "depth of field: everything is in focus"),
    ],
)
def test_cameras(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, change: dict, detail: str):
    for path, value in change.items():
        scene.camera.data.path_resolve(path)
        owner = scene.camera.data.dof if path.startswith("dof.") else scene.camera.data
        setattr(owner, path.removeprefix("dof."), value)
    assert lines(run()) == [f"Camera, camera: {detail}"]


@pytest.mark.parametrize(
    ("place", "size", "words"),
    [
        ((0, 0, -2), 1, []),
        ((0, 0, -0.5), 1, ["clip start 1"]),
        ((0, 0, -20), 1, ["clip end 10"]),
        ((0, 0, 0.5), 1, []),  # behind the camera
        ((3, 0, -0.5), 1, []),  # beside the image
        ((0, 0, -20), 1000, ["clip end 10"]),  # none of its corners is in the image
        ((0, -0.6, -3), 1000, ["clip end 10"]),
    ],
)
def test_clip_distances_that_hide_something(
    run: Export, scene: bpy.types.Scene, plane: bpy.types.Object, place: tuple, size: float, words: list[str]
):
    scene.camera.data.clip_start, scene.camera.data.clip_end = 1, 10
    plane.location, plane.scale = place, (size, size, 1)
    if place[1]:
        plane.rotation_euler.x = math.pi / 2 - 0.1  # a floor, nearly, from under the camera to the horizon
    assert [line.removeprefix("Camera, camera: ").split(":")[0] for line in lines(run())] == words


def test_triangles_without_area_in_a_sound_face(run: Export, plane: bpy.types.Object):
    mesh = bpy.data.meshes.new("Pole")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 0)], [], [(0, 1, 2, 3)])
    plane.data = mesh
    scene = run()
    assert len(scene.triangles) == 1
    assert lines(scene) == ["Plane, mesh: 1 triangle(s) without area are left out"]


def test_a_face_without_area_is_a_fault(run: Export, plane: bpy.types.Object):
    mesh = bpy.data.meshes.new("Bad")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (2, 0, 0)], [], [(0, 1, 2), (0, 1, 3)])
    plane.data = mesh
    with pytest.raises(
        InputError, match=r"^Scene: object 'Plane': face 1 has no area \(Mesh > Clean Up > Degenerate Dissolve removes it\)$"
    ):
        run()


def test_a_face_without_area_that_a_modifier_makes_is_left_out(run: Export, plane: bpy.types.Object):
    plane.modifiers.new("Solid", "SOLIDIFY").thickness = 0.0
    assert lines(run()) == ["Plane, mesh: 8 triangle(s) without area are left out"]


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


def test_a_dark_scene_is_a_fault_that_names_the_lamps(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    scene.world = None
    with pytest.raises(InputError, match=r"^Scene: the scene has no light: no emitting surface, and the world is black$"):
        run()
    lamp("SUN")
    with pytest.raises(InputError, match=r"world is black; its 1 lamp\(s\), 'SUN' first, are not supported yet$"):
        run()


def test_f12_says_how_to_render(scene: bpy.types.Scene, plane: bpy.types.Object):
    scene.render.engine = "RL_GUIDED"
    with pytest.raises(RuntimeError, match="not inside Blender yet: save it and run `rlg render"):
        bpy.ops.render.render()
