"""The world comes out as the emission that Cycles makes of it, and what cannot be told is reported by name."""

from collections.abc import Callable

import bpy
import pytest

from addon.export.resources import Resources
from addon.export.world import read_world, world_visibility
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import CAMERA, DIFFUSE, GLOSSY, TRANSMISSION, VISIBLE, Closure, Loss, Shader
from tests.addon.trees import node, only, surface, tree_of

Export = Callable[[], SceneData]


@pytest.fixture
def world(scene: bpy.types.Scene) -> bpy.types.World:
    return scene.world


def background(world: bpy.types.World) -> bpy.types.Node:
    return world.node_tree.nodes["Background"]


def read(world: bpy.types.World | None, resources: Resources | None = None) -> tuple[Shader, list[Loss]]:
    return read_world(world, resources or Resources())


def test_a_background(world: bpy.types.World):
    background(world).inputs["Color"].default_value = (0.25, 0.5, 0.75, 1)
    background(world).inputs["Strength"].default_value = 2
    shader, losses = read(world)
    assert only(shader) == Closure("emission", 1.0, {"color": (0.25, 0.5, 0.75), "strength": 2.0})
    assert losses == []


def test_no_world_no_shader_and_no_strength_are_black(world: bpy.types.World):
    assert read(None) == (Shader(""), [])
    background(world).inputs["Strength"].default_value = 0
    assert read(world) == (Shader("World"), [])
    world.node_tree.nodes.clear()
    assert read(world) == (Shader("World"), [])


def test_mixed_backgrounds(world: bpy.types.World):
    tree = world.node_tree
    mix = node(tree, "ShaderNodeMixShader", into=surface(tree), Factor=node(tree, "ShaderNodeLightPath").outputs["Is Camera Ray"])
    tree.links.new(background(world).outputs[0], mix.inputs[1])
    node(tree, "ShaderNodeBackground", into=mix.inputs[2], Strength=4)
    shader, losses = read(world)
    assert losses == []
    share = ("clamp", "MINMAX", (("light_path", "IS_CAMERA_RAY"), 0.0, 1.0))
    assert [tree_of(shader, closure.weight) for closure in shader.closures] == [("math", "SUBTRACT", (0,), (1.0, share, 0.0)), share]


@pytest.mark.parametrize("output", ["Generated", "Object"])
def test_coordinates_are_the_direction(world: bpy.types.World, output: str):
    node(world.node_tree, "ShaderNodeTexCoord", into=background(world).inputs["Color"], output=output)
    resources = Resources()
    shader, losses = read(world, resources)
    assert tree_of(shader, only(shader).inputs["color"]) == ("position",)
    assert losses == []
    assert resources.corner_attributes == []


@pytest.mark.parametrize("kind", ["ShaderNodeBsdfDiffuse", "ShaderNodeHoldout"])
def test_other_shaders_are_reported(world: bpy.types.World, kind: str):
    name = node(world.node_tree, kind, into=surface(world.node_tree)).name
    shader, (loss,) = read(world)
    assert shader.closures == ()
    assert (loss.object, loss.where) == ("World", f"node '{name}'")
    assert loss.detail.endswith("black stands in")


def test_other_nodes_are_reported(world: bpy.types.World):
    node(world.node_tree, "ShaderNodeTexSky", into=background(world).inputs["Color"])
    _, (loss,) = read(world)
    assert (loss.object, loss.where) == ("World", "node 'Sky Texture'")


@pytest.mark.parametrize(("kind", "bit"), [("camera", CAMERA), ("diffuse", DIFFUSE), ("glossy", GLOSSY), ("transmission", TRANSMISSION)])
def test_ray_visibility(world: bpy.types.World, kind: str, bit: int):
    assert world_visibility(None) == world_visibility(world) == VISIBLE
    setattr(world.cycles_visibility, kind, False)
    assert world_visibility(world) == VISIBLE - bit


def test_what_cannot_see_the_world_arrives(run: Export, world: bpy.types.World):
    bpy.ops.mesh.primitive_plane_add()
    world.cycles_visibility.camera = world.cycles_visibility.glossy = False
    exported = run()
    assert exported.world_visibility == VISIBLE - CAMERA - GLOSSY
    assert exported.coverage == ()


def test_a_volume_is_reported(world: bpy.types.World):
    node(world.node_tree, "ShaderNodeVolumeScatter", into=surface(world.node_tree).node.inputs["Volume"])
    assert read(world)[1] == [Loss("World", "node 'World Output', socket 'Volume'", "the volume is left out")]
