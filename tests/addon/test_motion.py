"""The coverage list names motion during the exposure, whatever its cause. It does not name still objects."""

import tracemalloc
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.export import motion
from blender_rl_guiding.scene.data import SceneData
from tests.addon.trees import lines

Export = Callable[[], SceneData]
BLURRED = "motion blur: it stands still at the frame's own time"


@pytest.fixture
def cube(scene: bpy.types.Scene) -> bpy.types.Object:
    """A cube in a scene with motion blur, beside a still plane."""
    scene.render.use_motion_blur = True
    scene.frame_set(5)
    bpy.ops.mesh.primitive_plane_add()
    bpy.ops.mesh.primitive_cube_add()
    return bpy.context.object


def drive(thing: bpy.types.ID, path: str, index: int = -1) -> None:
    thing.driver_add(path, index).driver.expression = "frame"


def keyframes(cube: bpy.types.Object) -> None:
    for frame in (1, 9):
        cube.location.x = frame
        cube.keyframe_insert("location", frame=frame)


def parent(cube: bpy.types.Object) -> None:
    bpy.ops.object.empty_add()
    drive(bpy.context.object, "location", 0)
    cube.parent = bpy.context.object


def constraint(cube: bpy.types.Object) -> None:
    bpy.ops.object.empty_add()
    drive(bpy.context.object, "location", 0)
    cube.constraints.new("COPY_LOCATION").target = bpy.context.object


def shape_key(cube: bpy.types.Object) -> None:
    cube.shape_key_add()
    cube.shape_key_add().data[0].co.z += 3.0
    drive(cube.data.shape_keys.key_blocks[1], "value")
    cube.data.shape_keys.key_blocks[1].slider_max = 10.0


def scene_time(cube: bpy.types.Object) -> None:
    tree = bpy.data.node_groups.new("Geometry", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    start, end, time, move = (
        tree.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeInputSceneTime", "GeometryNodeSetPosition")
    )
    for source, target in ((start.outputs[0], move.inputs[0]), (time.outputs[0], move.inputs["Offset"]), (move.outputs[0], end.inputs[0])):
        tree.links.new(source, target)
    cube.modifiers.new("Geometry", "NODES").node_group = tree


def wave(cube: bpy.types.Object) -> None:
    cube.modifiers.new("Wave", "WAVE")


SOURCES = {
    "a driver": lambda cube: drive(cube, "location", 0),
    "keyframes": keyframes,
    "a parent": parent,
    "a constraint": constraint,
    "a shape key": shape_key,
    "geometry nodes": scene_time,
    "a modifier": wave,
}


@pytest.mark.parametrize("source", SOURCES)
def test_sources_of_motion(run: Export, scene: bpy.types.Scene, cube: bpy.types.Object, source: str):
    SOURCES[source](cube)
    moving = run()
    assert lines(moving) == [f"Cube, : {BLURRED}"]
    scene.render.use_motion_blur = False
    still = run()
    assert lines(still) == []
    assert still.key == moving.key
    assert (scene.frame_current, scene.frame_subframe) == (5, 0.0)


def test_instances_that_move(run: Export, scene: bpy.types.Scene, cube: bpy.types.Object):
    collection = bpy.data.collections.new("Parts")
    collection.objects.link(cube)
    scene.collection.objects.unlink(cube)
    bpy.ops.object.empty_add()
    bpy.context.object.instance_type, bpy.context.object.instance_collection = "COLLECTION", collection
    assert lines(run()) == []
    drive(bpy.context.object, "rotation_euler", 2)
    assert lines(run()) == [f"Cube, : {BLURRED}"]


def test_the_camera(run: Export, scene: bpy.types.Scene, cube: bpy.types.Object):
    assert lines(run()) == []
    drive(scene.camera.data, "lens")
    assert lines(run()) == [f"Camera, : {BLURRED}"]


def test_what_changes_otherwise_is_not_blurred(run: Export, scene: bpy.types.Scene, cube: bpy.types.Object):
    """Not listed: colours, lamps, hidden objects, and objects without motion blur in Cycles."""
    drive(cube, "color", 0)
    bpy.ops.object.light_add()
    drive(bpy.context.object, "location", 0)
    hidden = cube.copy()
    hidden.hide_render = True
    scene.collection.objects.link(hidden)
    drive(hidden, "location", 0)
    drive(cube, "location", 2)
    cube.cycles.use_motion_blur = False
    assert lines(run()) == []


@pytest.mark.parametrize(("position", "moves"), [("START", True), ("END", False)])
def test_the_shutter(run: Export, scene: bpy.types.Scene, cube: bpy.types.Object, position: str, moves: bool):
    """A cube that moves from frame 5 on."""
    scene.render.motion_blur_position = position
    cube.driver_add("location", 0).driver.expression = "max(frame, 5)"
    assert lines(run()) == ([f"Cube, : {BLURRED}"] if moves else [])
    assert np.isfinite(run().vertices).all()


def test_things_of_one_name(run: Export, scene: bpy.types.Scene, cube: bpy.types.Object, tmp_path: Path):
    """A library with a moving cube and a plane; in this file a still cube and a moving plane."""
    drive(cube, "location", 0)
    library = tmp_path / "library.blend"
    bpy.data.libraries.write(str(library), {cube, bpy.data.objects["Plane"]})
    cube.driver_remove("location", 0)
    drive(bpy.data.objects["Plane"], "location", 0)
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.objects = ["Cube", "Plane"]
    for thing in wanted.objects:
        scene.collection.objects.link(thing)
    assert sorted(lines(run())) == [f"Cube, : {BLURRED}", f"Plane, : {BLURRED}"]


def test_a_mesh_that_cannot_be_read(run: Export, scene: bpy.types.Scene, cube: bpy.types.Object, monkeypatch: pytest.MonkeyPatch):
    """The exporter still knows the mesh's place."""

    def fails(*_: object) -> None:
        raise RuntimeError("no data")

    drive(cube, "location", 0)
    monkeypatch.setattr(motion, "read_array", fails)
    assert lines(run()) == [f"Cube, : {BLURRED}"]


def test_many_instances_take_little_memory(scene: bpy.types.Scene, cube: bpy.types.Object):
    parts = bpy.data.collections.new("Parts")
    parts.objects.link(cube)
    for _ in range(200):
        empty = bpy.data.objects.new("Empty", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", parts
        scene.collection.objects.link(empty)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    tracemalloc.start()
    assert not [*motion.of_motion(depsgraph, lambda *_: None)]
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 200 * 500 + 20_000
