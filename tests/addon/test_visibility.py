"""Objects are hidden from the same kinds of rays as in Cycles."""

from collections.abc import Callable

import bpy
import pytest

from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import CAMERA, DIFFUSE, GLOSSY, SHADOW, TRANSMISSION, VISIBLE

Export = Callable[[], SceneData]


@pytest.fixture
def cube(scene: bpy.types.Scene) -> bpy.types.Object:
    bpy.ops.mesh.primitive_cube_add()
    return bpy.context.object


def test_objects_are_visible_to_all_rays(run: Export, cube: bpy.types.Object):
    assert run().visibility.tolist() == [VISIBLE]


@pytest.mark.parametrize(
    ("switch", "bit"), [("camera", CAMERA), ("diffuse", DIFFUSE), ("glossy", GLOSSY), ("transmission", TRANSMISSION), ("shadow", SHADOW)]
)
def test_ray_visibility(run: Export, cube: bpy.types.Object, switch: str, bit: int):
    setattr(cube, f"visible_{switch}", False)
    scene = run()
    assert scene.visibility.tolist() == [VISIBLE - bit]
    assert scene.coverage == ()


def test_an_object_that_no_ray_sees_leaves_no_trace(run: Export, cube: bpy.types.Object):
    bpy.ops.mesh.primitive_cube_add(location=(9, 0, 0))
    hidden = bpy.context.object
    for kind in ("camera", "diffuse", "glossy", "transmission", "shadow"):
        setattr(hidden, f"visible_{kind}", False)
    scene = run()
    assert len(scene.triangles) == 12
    assert scene.bounds[1][0] == 1


def test_instances_are_hidden_with_their_instancer(run: Export, cube: bpy.types.Object):
    collection = bpy.data.collections.new("Group")
    collection.objects.link(cube)
    bpy.context.scene.collection.objects.unlink(cube)
    empty = bpy.data.objects.new("Instance", None)
    empty.instance_type, empty.instance_collection, empty.visible_glossy = "COLLECTION", collection, False
    bpy.context.scene.collection.objects.link(empty)
    cube.visible_shadow = False
    assert run().visibility.tolist() == [VISIBLE - GLOSSY - SHADOW]


def test_indirect_only_collections_are_hidden_from_the_camera(run: Export, scene: bpy.types.Scene, cube: bpy.types.Object):
    collection = bpy.data.collections.new("Indirect")
    scene.collection.children.link(collection)
    collection.objects.link(cube)
    scene.collection.objects.unlink(cube)
    scene.view_layers[0].layer_collection.children["Indirect"].indirect_only = True
    exported = run()
    assert exported.visibility.tolist() == [VISIBLE - CAMERA]
    assert exported.coverage == ()
