"""Attributes of instances, with and without ids. The parity suite compares the values with Cycles."""

from collections.abc import Callable

import bpy
import pytest

from blender_rl_guiding.scene.data import SceneData
from tests.addon.trees import lines, node, put
from tests.parity.cases.custom import Geometry

Export = Callable[[], SceneData]


@pytest.mark.parametrize(
    ("factor", "found", "losses"),
    [
        (10.0, [0.0, 0.25, 0.5, 0.75], []),
        (0.0, [0.0, 0.0, 0.0, 0.0], ["Plane, instances: some have the id of another: they lack its attributes"]),
    ],
    ids=["different", "equal"],
)
def test_instances_with_ids(
    run: Export, scene: bpy.types.Scene, paint: bpy.types.Material, factor: float, found: list[float], losses: list[str]
):
    """Each instance has the id index * factor."""
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    cube.data.materials.append(paint)
    attribute = node(paint.node_tree, "ShaderNodeAttribute", into=put(paint, "ShaderNodeBsdfDiffuse").inputs["Color"])
    attribute.attribute_type, attribute.attribute_name = "INSTANCER", "tint"
    bpy.ops.mesh.primitive_plane_add()
    nodes = Geometry(bpy.data, bpy.context.object)
    tinted = nodes.stored(nodes.on_points(nodes.own, nodes.of(cube, as_instance=False)), "tint", 0.25)
    nodes.end(nodes.stored(tinted, "id", factor, "INT"))
    exported = run()
    assert exported.object_attributes[0, 1:, 0].tolist() == found
    assert lines(exported) == losses


def test_instancers_without_a_geometry(run: Export, scene: bpy.types.Scene, paint: bpy.types.Material):
    """An Empty shows a collection: the Empty alone, and the Empty on points that have the attribute."""
    attribute = node(paint.node_tree, "ShaderNodeAttribute", into=put(paint, "ShaderNodeBsdfDiffuse").inputs["Color"])
    attribute.attribute_type, attribute.attribute_name = "INSTANCER", "tint"
    bpy.ops.mesh.primitive_cube_add()
    cube, parts = bpy.context.object, bpy.data.collections.new("Parts")
    cube.data.materials.append(paint)
    parts.objects.link(cube)
    scene.collection.objects.unlink(cube)
    cube["tint"] = 0.75
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", parts
    scene.collection.objects.link(empty)
    assert run().object_attributes[0, :, 0].tolist() == [0.75]
    bpy.ops.mesh.primitive_plane_add()
    nodes = Geometry(bpy.data, bpy.context.object)
    nodes.end(nodes.joined(nodes.own, nodes.stored(nodes.on_points(nodes.own, nodes.of(empty, as_instance=True)), "tint", 0.25)))
    exported = run()
    assert sorted(exported.object_attributes[0, :, 0].tolist()) == [0.0, 0.0, 0.25, 0.5, 0.75, 0.75]
    assert lines(exported) == []


@pytest.mark.parametrize("by_nodes", [False, True])
def test_objects_of_a_collection_that_have_instances(run: Export, scene: bpy.types.Scene, paint: bpy.types.Material, by_nodes: bool):
    """An Empty or geometry nodes show the collection. Members before the object do not render. The numbers are those of Cycles."""
    attribute = node(paint.node_tree, "ShaderNodeAttribute", into=put(paint, "ShaderNodeBsdfDiffuse").inputs["Color"])
    attribute.attribute_type, attribute.attribute_name = "INSTANCER", "tint"
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    cube.data.materials.append(paint)
    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object
    nodes = Geometry(bpy.data, plane)
    nodes.end(nodes.stored(nodes.on_points(nodes.own, nodes.of(cube, as_instance=True)), "tint", 0.25))
    parts, off = bpy.data.collections.new("Parts"), bpy.data.collections.new("Off")
    parts.children.link(off)
    off.hide_render = True
    for collection, hidden in ((parts, True), (off, False), (parts, False)):
        member = bpy.data.objects.new("A member", None)
        member.hide_render = hidden
        collection.objects.link(member)
    scene.collection.objects.unlink(plane)
    parts.objects.link(plane)
    cube.hide_render = True
    holder = bpy.data.objects.new("Holder", bpy.data.meshes.new("Holder") if by_nodes else None)
    scene.collection.objects.link(holder)
    if by_nodes:
        nodes = Geometry(bpy.data, holder)
        collection = nodes.tree.nodes.new("GeometryNodeCollectionInfo")
        collection.inputs["Collection"].default_value = parts
        nodes.end(collection.outputs[0])
    else:
        holder.instance_type, holder.instance_collection = "COLLECTION", parts
    exported = run()
    assert sorted(exported.object_attributes[0, :, 0].tolist()) == [0.0, 0.25, 0.5, 0.75]
    assert lines(exported) == []
