"""Values pass through groups, reroutes and muted nodes as in Cycles."""

from typing import Any

import bpy
import pytest

from tests.addon.trees import color, color_of, node, probe, read

A, B = (0.25, 0.5, 0.75, 1), (0.5, 0.25, 1, 1)
a, b = A[:3], (0.5, 0.25, 1.0)


@pytest.fixture
def tree(paint: bpy.types.Material) -> bpy.types.NodeTree:
    return paint.node_tree


def group_of(tree: bpy.types.NodeTree, socket: str = "NodeSocketColor") -> tuple[bpy.types.Node, bpy.types.NodeTree, Any, Any]:
    """(group node, its tree, the socket of its input inside, the socket of its output inside)."""
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.interface.new_socket("In", in_out="INPUT", socket_type=socket)
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    user = tree.nodes.new("ShaderNodeGroup")
    user.node_tree = group
    return user, group, group.nodes.new("NodeGroupInput").outputs[0], group.nodes.new("NodeGroupOutput").inputs[0]


def test_groups_hand_on_links_and_values(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    user, group, inside, out = group_of(tree)
    node(group, "ShaderNodeInvert", into=out, Color=inside)
    tree.links.new(user.outputs[0], color_of(tree))
    user.inputs[0].default_value = A
    assert color(paint) == ("invert", (1.0, a))
    node(tree, "ShaderNodeNewGeometry", into=user.inputs[0], output="Normal")
    assert color(paint) == ("invert", (1.0, ("normal",)))
    group.links.clear()
    out.default_value = B
    assert color(paint) == b


def test_two_users_of_a_group_have_their_own_values(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    first, group, inside, out = group_of(tree)
    group.links.new(inside, out)
    second = tree.nodes.new("ShaderNodeGroup")
    second.node_tree = group
    first.inputs[0].default_value, second.inputs[0].default_value = A, B
    probe(tree, "ShaderNodeMixRGB", Color1=first.outputs[0], Color2=second.outputs[0])
    assert color(paint) == ("mix", "MIX", (1, 0), (0.5, a, b))


def test_groups_in_groups(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    outer, group, inside, out = group_of(tree)
    inner, inner_group, inner_inside, inner_out = group_of(group)
    node(inner_group, "ShaderNodeGamma", into=inner_out, Color=inner_inside)
    group.links.new(inside, inner.inputs[0])
    group.links.new(inner.outputs[0], out)
    outer.inputs[0].default_value = A
    tree.links.new(outer.outputs[0], color_of(tree))
    assert color(paint) == ("gamma", (a, 1.0))


def test_sockets_of_groups_convert(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    user, group, inside, out = group_of(tree, "NodeSocketFloat")
    group.links.new(inside, out)
    node(tree, "ShaderNodeRGB", into=user.inputs[0]).outputs[0].default_value = A
    tree.links.new(user.outputs[0], color_of(tree))
    assert color(paint) == ("luminance", (a,))


def test_reroutes_and_muted_nodes_hand_on_what_arrives_and_nothing_else(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    emission = color_of(tree)
    emission.default_value = B
    invert = node(tree, "ShaderNodeInvert", Color=A)
    invert.mute = True
    reroute = tree.nodes.new("NodeReroute")
    tree.links.new(invert.outputs[0], reroute.inputs[0])
    tree.links.new(reroute.outputs[0], emission)
    assert color(paint) == b  # as in Cycles: not the colour of the muted node
    node(tree, "ShaderNodeNewGeometry", into=invert.inputs["Color"], output="Normal")
    assert color(paint) == ("normal",)


def test_muted_links_do_not_count(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    emission = color_of(tree)
    emission.default_value = B
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], emission).is_muted = True
    assert color(paint) == b


def test_what_two_sockets_need_is_computed_once(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    mix = probe(tree, "ShaderNodeMixRGB")
    shared = node(tree, "ShaderNodeTexGradient")
    for name in ("Color1", "Color2"):
        tree.links.new(shared.outputs["Color"], mix.inputs[name])
    shader, _ = read(paint)
    assert [step.op for step in shader.code] == ["attribute", "gradient", "mix"]
