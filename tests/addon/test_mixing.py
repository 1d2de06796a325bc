"""Trees of Mix and Add Shaders, groups and outputs become the closures that reach the surface, with their shares."""

from typing import Any

import bpy
import pytest

from addon.export.materials import read_material
from addon.export.resources import Resources
from blender_rl_guiding.scene.description import Closure
from tests.addon.trees import node, only, put, read, surface, tree_of

DIFFUSE, EMISSION, GLOSSY = "ShaderNodeBsdfDiffuse", "ShaderNodeEmission", "ShaderNodeBsdfGlossy"


def mixed(material: bpy.types.Material, factor: Any, first: Any, second: Any) -> bpy.types.Node:
    """A Mix Shader, linked to the surface."""
    mix = put(material, "ShaderNodeMixShader", Factor=factor)
    for shader, socket in ((first, mix.inputs[1]), (second, mix.inputs[2])):
        if shader is not None:
            material.node_tree.links.new(shader.outputs[0], socket)
    return mix


def weights(material: bpy.types.Material) -> list[tuple[str, Any]]:
    shader, notes = read(material)
    assert notes == []
    return [(closure.kind, tree_of(shader, closure.weight)) for closure in shader.closures]


def test_mix_and_add_become_weights(paint: bpy.types.Material):
    tree = paint.node_tree
    glossy, diffuse, emission = (tree.nodes.new(kind) for kind in (GLOSSY, DIFFUSE, EMISSION))
    added = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(diffuse.outputs[0], added.inputs[0])
    tree.links.new(emission.outputs[0], added.inputs[1])
    mixed(paint, 0.25, glossy, added)
    assert weights(paint) == [("glossy", 0.75), ("diffuse", 0.25), ("emission", 0.25)]


def test_a_varying_share_is_clamped_and_computed(paint: bpy.types.Material):
    tree = paint.node_tree
    inner = tree.nodes.new("ShaderNodeMixShader")
    inner.inputs["Factor"].default_value = 0.25
    tree.links.new(tree.nodes.new(GLOSSY).outputs[0], inner.inputs[1])
    mixed(paint, node(tree, "ShaderNodeLayerWeight").outputs["Facing"], tree.nodes.new(DIFFUSE), inner)
    share = ("clamp", "MINMAX", (("layer_weight", "FACING", (0.5,)), 0.0, 1.0))
    assert weights(paint) == [
        ("diffuse", ("math", "SUBTRACT", (0,), (1.0, share, 0.0))),
        ("glossy", ("math", "MULTIPLY", (0,), (share, 0.75, 0.0))),
    ]


@pytest.mark.parametrize(("factor", "left"), [(0.0, "diffuse"), (1.0, "glossy")])
def test_a_share_of_nothing_is_dropped_with_its_losses(paint: bpy.types.Material, factor: float, left: str):
    tree = paint.node_tree
    noises = [node(tree, "ShaderNodeTexVoronoi", into=None).outputs["Color"] for _ in range(2)]
    shaders = [node(tree, kind, Color=noise) for kind, noise in zip((DIFFUSE, GLOSSY), noises, strict=True)]
    mixed(paint, factor, *shaders)
    shader, notes = read(paint)
    assert [(closure.kind, closure.weight) for closure in shader.closures] == [(left, 1.0)]
    assert len(notes) == 1


def test_a_mix_with_nothing_is_darker(paint: bpy.types.Material):
    mixed(paint, 0.25, None, paint.node_tree.nodes.new(DIFFUSE))
    assert weights(paint) == [("diffuse", 0.25)]


@pytest.mark.parametrize("muted", [False, True])
def test_no_surface_is_black(paint: bpy.types.Material, muted: bool):
    if muted:
        put(paint, GLOSSY).mute = True
    assert weights(paint) == []


def test_a_muted_mix_passes_its_first_shader_on(paint: bpy.types.Material):
    mixed(paint, 0.25, paint.node_tree.nodes.new(DIFFUSE), paint.node_tree.nodes.new(GLOSSY)).mute = True
    assert weights(paint) == [("diffuse", 1.0)]


def test_shaders_inside_groups(paint: bpy.types.Material):
    group = bpy.data.node_groups.new("Coat", "ShaderNodeTree")
    group.interface.new_socket("Under", in_out="INPUT", socket_type="NodeSocketShader")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    mix = group.nodes.new("ShaderNodeMixShader")
    group.links.new(group.nodes.new("NodeGroupInput").outputs[0], mix.inputs[1])
    group.links.new(group.nodes.new("ShaderNodeBsdfToon").outputs[0], mix.inputs[2])
    group.links.new(mix.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    user = paint.node_tree.nodes.new("ShaderNodeGroup")
    user.node_tree = group
    node(paint.node_tree, GLOSSY, into=user.inputs[0])
    paint.node_tree.links.new(user.outputs[0], surface(paint.node_tree))
    shader, notes = read(paint)
    assert [(closure.kind, closure.weight) for closure in shader.closures] == [("glossy", 0.5), ("diffuse", 0.5)]
    assert notes == ["group 'Coat', node 'Toon BSDF': Toon BSDF is not supported: a diffuse surface of its colour stands in"]


def test_the_active_output_of_cycles_counts(paint: bpy.types.Material):
    tree = paint.node_tree
    put(paint, DIFFUSE)
    for target, kind in (("EEVEE", EMISSION), ("CYCLES", GLOSSY)):
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        output.target = target
        node(tree, kind, into=output.inputs["Surface"])
    assert weights(paint) == [("glossy", 1.0)]


def test_no_material_is_principled_and_no_surface_but_a_volume_is_nothing(paint: bpy.types.Material):
    assert read_material(None, Resources())[0].closures == (Closure("principled", 1.0),)
    node(paint.node_tree, "ShaderNodeVolumeScatter", into=surface(paint.node_tree).node.inputs["Volume"])
    shader, notes = read(paint)
    assert notes == ["node 'Material Output', socket 'Volume': the volume is left out"]
    assert only(shader) == Closure("transparent", 1.0, {"color": (1.0, 1.0, 1.0)})
