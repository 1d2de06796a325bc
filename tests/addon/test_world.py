"""The world becomes Cycles' emission. Nodes without an equivalent are reported by name."""

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon import cycles_pictures
from addon.export import by_cycles
from addon.export.resources import Resources
from addon.export.world import read_world, world_visibility
from blender_rl_guiding.errors import InputError
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


@pytest.fixture
def rotated(world: bpy.types.World) -> bpy.types.Node:
    """The world's colour is the direction, turned by a node inside a group. The exporter does not support this node."""
    group = bpy.data.node_groups.new("Turn", "ShaderNodeTree")
    group.interface.new_socket("Vector", in_out="OUTPUT", socket_type="NodeSocketVector")
    inner = node(group, "ShaderNodeVectorRotate", into=group.nodes.new("NodeGroupOutput").inputs[0], Angle=0.5)
    node(group, "ShaderNodeTexCoord", output="Generated", into=inner.inputs["Vector"])
    outer = node(world.node_tree, "ShaderNodeGroup")
    outer.node_tree = group
    world.node_tree.links.new(outer.outputs[0], background(world).inputs["Color"])
    return inner


def test_a_picture_stands_in_for_another_node(world: bpy.types.World, rotated: bpy.types.Node):
    resources = Resources()
    shader, (loss,) = read(world, resources)
    assert loss == Loss(
        "World",
        "group 'Turn', node 'Vector Rotate', socket 'Vector'",
        "Vector Rotate is not supported: a picture of it stands in",
    )
    assert tree_of(shader, only(shader).inputs["color"]) == ("environment", (0, 0, 0), (("position",),))
    (texture,) = resources.textures
    rows, columns, _ = texture.texels.shape
    longitude = np.pi * (1 - 2 * (np.arange(columns) + 0.5) / columns) + 0.5
    latitude = np.pi * (0.5 - (np.arange(rows)[:, None] + 0.5) / rows)
    x, y, z = np.broadcast_arrays(np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude))
    np.testing.assert_allclose(texture.texels[..., :3], np.stack([x, y, z], axis=-1), atol=2e-4)  # a tenth of a pixel


@pytest.fixture
def jobs(monkeypatch: pytest.MonkeyPatch) -> list[dict]:
    """The jobs of the second Blender, in order. The picture of job k has the value k everywhere."""
    jobs: list[dict] = []

    def render(job: dict, *_: object, picture: tuple[int, ...], **__: object) -> dict[str, np.ndarray]:
        jobs.append(job)
        return {"picture": np.full(picture, len(jobs), np.float32)}

    monkeypatch.setattr(by_cycles, "render", render)
    return jobs


def test_a_group_that_is_used_twice_has_two_pictures(world: bpy.types.World, rotated: bpy.types.Node, jobs: list[dict]):
    tree = world.node_tree
    first = tree.nodes["Group"]
    second = node(tree, "ShaderNodeGroup")
    second.node_tree = first.node_tree
    node(tree, "ShaderNodeMixRGB", into=background(world).inputs["Color"], Color1=first.outputs[0], Color2=second.outputs[0])
    resources = Resources()
    read(world, resources)
    assert [job["groups"] for job in jobs] == [[first.name], [second.name]]
    assert [texture.texels[0, 0, 0] for texture in resources.textures] == [1, 2]


def test_a_linked_world_is_looked_for_in_its_library(world: bpy.types.World, rotated: bpy.types.Node, jobs: list[dict], tmp_path: Path):
    library = tmp_path / "library.blend"
    bpy.data.libraries.write(str(library), {world})
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.worlds = ["World"]
    read(wanted.worlds[0])
    assert jobs[0]["blend"] == str(library)


def test_what_a_picture_is_made_of(scene: bpy.types.Scene, rotated: bpy.types.Node, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The job names the world and the frame. The frame may be negative."""
    library = tmp_path / "library.blend"
    bpy.data.libraries.write(str(library), {scene.world})
    monkeypatch.setattr(cycles_pictures, "panorama", lambda: scene)
    monkeypatch.setattr(cycles_pictures, "look_around", lambda scene, *_: scene.frame_current_final)
    job = {"blend": str(library), "world": "World", "groups": ["Group"], "node": rotated.name, "output": "Vector", "frame": -1.25}
    assert cycles_pictures.node(job)["picture"] == -1.25
    with pytest.warns(UserWarning, match="Other"), pytest.raises(RuntimeError, match="no world 'Other' in"):
        cycles_pictures.node(job | {"world": "Other"})


def test_without_a_picture_both_are_reported(world: bpy.types.World, rotated: bpy.types.Node, monkeypatch: pytest.MonkeyPatch):
    def render(*_: object, **__: object) -> None:
        raise InputError("no Blender")

    monkeypatch.setattr(by_cycles, "render", render)
    _, losses = read(world)
    where = "group 'Turn', node 'Vector Rotate'"
    assert [(loss.where, loss.detail.partition(":")[0]) for loss in losses] == [
        (where, "Vector Rotate is not supported"),
        (f"{where}, socket 'Vector'", "there is no picture of it either"),
    ]


def test_nodes_that_know_more_than_a_direction_have_no_picture(world: bpy.types.World):
    node(world.node_tree, "ShaderNodeTexCoord", into=background(world).inputs["Color"], output="Window")
    _, (loss,) = read(world)
    assert loss == Loss(
        "World", "node 'Texture Coordinate', socket 'Window'", "not supported: the unlinked values of the sockets that it leads to stand in"
    )


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
