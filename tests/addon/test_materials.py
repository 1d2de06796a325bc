"""Materials and world come out as Cycles understands them, and every input that cannot be told is reported by name."""

from collections.abc import Callable
from typing import Any

import bpy
import pytest

from blender_rl_guiding.scene.data import Loss, SceneData

Export = Callable[[], SceneData]


@pytest.fixture
def thing(new_material: Callable[[str], bpy.types.Material]) -> bpy.types.Object:
    """A plane with a material whose node tree is an output alone."""
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.data.materials.append(new_material("Paint"))
    return bpy.context.object


def tree(thing: bpy.types.Object) -> bpy.types.NodeTree:
    return thing.data.materials[0].node_tree


def shader(tree: bpy.types.NodeTree, kind: str, **inputs: Any) -> bpy.types.Node:
    """Link a new shader to the output; spaces in the names of its inputs are written as underscores."""
    node = tree.nodes.new(kind)
    output = next(n for n in tree.nodes if n.bl_idname.startswith("ShaderNodeOutput"))
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    for name, value in inputs.items():
        node.inputs[name.replace("_", " ")].default_value = value
    return node


def principled(thing: bpy.types.Object, **inputs: Any) -> bpy.types.Node:
    return shader(tree(thing), "ShaderNodeBsdfPrincipled", **{"Specular_IOR_Level": 0} | inputs)


def places(scene: SceneData) -> list[str]:
    assert all(loss.object == "Plane" for loss in scene.coverage)
    return [loss.where for loss in scene.coverage]


def colors(scene: SceneData) -> tuple[Any, Any]:
    (material,) = scene.materials
    return pytest.approx(material.base_color), pytest.approx(material.emission)


def test_principled_is_its_base_color_and_emission(run: Export, thing: bpy.types.Object):
    principled(thing, Base_Color=(0.1, 0.2, 0.3, 1), Emission_Color=(1, 0.5, 0.25, 1), Emission_Strength=4)
    scene = run()
    assert colors(scene) == ((0.1, 0.2, 0.3), (4, 2, 1))
    assert scene.coverage == ()


def test_diffuse_and_emission_nodes(run: Export, thing: bpy.types.Object):
    shader(tree(thing), "ShaderNodeBsdfDiffuse", Color=(0.1, 0.2, 0.3, 1))
    scene = run()
    assert colors(scene) == ((0.1, 0.2, 0.3), (0, 0, 0))
    assert scene.coverage == ()
    shader(tree(thing), "ShaderNodeEmission", Color=(1, 0.5, 0.25, 1), Strength=4)
    scene = run()
    assert colors(scene) == ((0, 0, 0), (4, 2, 1))
    assert scene.coverage == ()


@pytest.mark.parametrize(
    ("socket", "value"),
    [
        ("Metallic", 0.5),
        ("Alpha", 0.5),
        ("Diffuse Roughness", 0.5),
        ("Subsurface Weight", 0.1),
        ("Specular IOR Level", 0.5),
        ("Transmission Weight", 1.0),
        ("Coat Weight", 1.0),
        ("Sheen Weight", 1.0),
    ],
)
def test_what_a_diffuse_surface_lacks_is_reported(run: Export, thing: bpy.types.Object, socket: str, value: float):
    principled(thing, **{socket: value})
    (loss,) = run().coverage
    assert loss.object == "Plane"
    assert loss.where == f"material 'Paint', node 'Principled BSDF', socket '{socket}'"
    assert loss.detail.startswith(f"{value:g}: a diffuse surface stands in")


def test_what_has_no_effect_is_not_reported(run: Export, thing: bpy.types.Object):
    node = principled(
        thing,
        Roughness=0.1,
        IOR=1.3,
        Coat_Roughness=0.5,
        Sheen_Roughness=0.1,
        Anisotropic=1,
        Thin_Film_Thickness=100,
        Emission_Color=(0, 0, 0, 1),
    )
    noise = tree(thing).nodes.new("ShaderNodeTexNoise")
    tree(thing).links.new(noise.outputs[0], node.inputs["Emission Strength"])  # of a black emission
    tree(thing).links.new(noise.outputs[0], node.inputs["Roughness"])  # of a reflection that is off
    tree(thing).links.new(noise.outputs[0], node.inputs["Base Color"]).is_muted = True
    tree(thing).nodes.new("ShaderNodeBsdfGlass")  # linked to nothing
    assert run().coverage == ()


@pytest.mark.parametrize(
    "socket", ["Base Color", "Metallic", "Normal", "Alpha", "Specular IOR Level", "Emission Color", "Emission Strength"]
)
def test_linked_inputs_are_reported(run: Export, thing: bpy.types.Object, socket: str):
    node = principled(thing, Emission_Strength=1)
    tree(thing).links.new(tree(thing).nodes.new("ShaderNodeTexNoise").outputs[0], node.inputs[socket])
    scene = run()
    assert places(scene) == [f"material 'Paint', node 'Principled BSDF', socket '{socket}'"]
    assert "linked" in scene.coverage[0].detail


def test_an_image_texture_is_reported_through_a_reroute(run: Export, thing: bpy.types.Object):
    node, nodes, links = principled(thing, Base_Color=(0.25, 0.5, 0.75, 1)), tree(thing).nodes, tree(thing).links
    texture, reroute = nodes.new("ShaderNodeTexImage"), nodes.new("NodeReroute")
    links.new(reroute.outputs[0], node.inputs["Base Color"])
    assert run().coverage == ()  # the reroute leads nowhere
    links.new(texture.outputs[0], reroute.inputs[0])
    assert run().coverage == (
        Loss(
            "Plane",
            "material 'Paint', node 'Principled BSDF', socket 'Base Color'",
            "linked: its unlinked value (0.25, 0.5, 0.75) stands in",
        ),
    )


@pytest.mark.parametrize("kind", ["ShaderNodeBsdfGlass", "ShaderNodeMixShader", "ShaderNodeBsdfTransparent", "ShaderNodeBsdfToon"])
def test_other_shaders_are_reported(run: Export, thing: bpy.types.Object, kind: str):
    node = shader(tree(thing), kind)
    scene = run()
    assert places(scene) == [f"material 'Paint', node '{node.name}'"]
    assert scene.coverage[0].detail == f"{node.bl_label} is not supported: a diffuse grey of 0.8 stands in"
    assert colors(scene) == ((0.8, 0.8, 0.8), (0, 0, 0))


@pytest.mark.parametrize(("socket", "kind"), [("Volume", "ShaderNodeVolumeScatter"), ("Displacement", "ShaderNodeDisplacement")])
def test_volume_and_displacement_are_reported(run: Export, thing: bpy.types.Object, socket: str, kind: str):
    principled(thing)
    output = next(n for n in tree(thing).nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    tree(thing).links.new(tree(thing).nodes.new(kind).outputs[0], output.inputs[socket])
    assert places(run()) == [f"material 'Paint', node 'Material Output', socket '{socket}'"]


def test_rough_diffuse_and_excess_are_reported(run: Export, thing: bpy.types.Object):
    shader(tree(thing), "ShaderNodeBsdfDiffuse", Color=(2, 0.5, 0.5, 1), Roughness=0.5)
    scene = run()
    assert [place.split()[-1] for place in places(scene)] == ["'Roughness'", "'Color'"]
    assert colors(scene)[0] == (1, 0.5, 0.5)


@pytest.mark.parametrize("muted", [False, True])
def test_no_surface_is_black(run: Export, thing: bpy.types.Object, muted: bool):
    if muted:
        principled(thing).mute = True
    scene = run()
    assert colors(scene) == ((0, 0, 0), (0, 0, 0))
    assert scene.coverage == ()


def test_a_loss_is_listed_once_for_each_object(run: Export, thing: bpy.types.Object):
    principled(thing, Metallic=1)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Other", thing.data))
    assert [loss.object for loss in run().coverage] == ["Plane", "Other"]


def world(scene: bpy.types.Scene) -> bpy.types.Node:
    return scene.world.node_tree.nodes["Background"]


def test_world_is_color_times_strength(run: Export, scene: bpy.types.Scene, thing: bpy.types.Object):
    world(scene).inputs["Color"].default_value = (0.1, 0.2, 0.3, 1)
    world(scene).inputs["Strength"].default_value = 2
    assert run().world == pytest.approx((0.2, 0.4, 0.6))


@pytest.mark.parametrize("present", [True, False])
def test_no_world_or_no_shader_is_black(run: Export, scene: bpy.types.Scene, thing: bpy.types.Object, present: bool):
    principled(thing, Emission_Strength=1)
    scene.world.node_tree.nodes.clear()
    if not present:
        scene.world = None
    assert run().world == (0, 0, 0)
    assert run().coverage == ()


@pytest.mark.parametrize("socket", ["Color", "Strength"])
def test_a_linked_world_is_reported(run: Export, scene: bpy.types.Scene, thing: bpy.types.Object, socket: str):
    principled(thing)
    texture = scene.world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    scene.world.node_tree.links.new(texture.outputs[0], world(scene).inputs[socket])
    (loss,) = run().coverage
    assert (loss.object, loss.where) == ("World", f"node 'Background', socket '{socket}'")


def test_other_world_shaders_are_reported(run: Export, scene: bpy.types.Scene, thing: bpy.types.Object):
    principled(thing, Emission_Strength=1)
    shader(scene.world.node_tree, "ShaderNodeMixShader")
    (loss,) = run().coverage
    assert (loss.object, loss.where) == ("World", "node 'Mix Shader'")
    assert "black stands in" in loss.detail


@pytest.mark.parametrize(("limits", "expected"), [((12, 4), 5), ((3, 8), 4), ((0, 0), 1)])
def test_the_depth_is_the_one_that_diffuse_paths_have_in_cycles(
    run: Export, scene: bpy.types.Scene, thing: bpy.types.Object, limits: tuple[int, int], expected: int
):
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces = limits
    assert run().max_bounces == expected
