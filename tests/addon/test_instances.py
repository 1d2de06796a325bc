"""A mesh with many instances is kept once, and renders like its copies."""

from collections.abc import Callable
from dataclasses import replace

import bpy
import numpy as np
import pytest

from addon.export import attributes, instances
from blender_rl_guiding.render import render
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import CAMERA, GLOSSY, VISIBLE
from blender_rl_guiding.settings import Render
from tests.addon.trees import lines, node
from tests.instancing import flattened

Export = Callable[[], SceneData]
Things = Callable[[bpy.types.Object], None]


@pytest.fixture
def both(run: Export, monkeypatch: pytest.MonkeyPatch) -> Callable[[], tuple[SceneData, SceneData]]:
    """Exports the scene twice: (all meshes kept once, all meshes copied)."""

    def go() -> tuple[SceneData, SceneData]:
        copied = run()
        monkeypatch.setattr(instances, "COPIES", 0)
        kept = run()
        monkeypatch.undo()
        assert not len(copied.instances)
        return kept, copied

    return go


@pytest.fixture
def thing(scene: bpy.types.Scene, new_material: Callable[[str], bpy.types.Material]) -> bpy.types.Object:
    """A turned and stretched ball. Its material reads UV maps, generated and tangent coordinates, and attributes of the object."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=0.4, rotation=(0.2, 0.3, 0.4), scale=(1, 1.2, 0.7))
    thing = bpy.context.object
    thing.name, thing.color = "Ball", (0.2, 0.9, 0.4, 1)
    bpy.ops.object.shade_smooth()
    material = new_material("Paint")
    tree = material.node_tree
    coordinates, info = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeObjectInfo")
    checker, noise, bump = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexChecker", "TexNoise", "Bump"))
    normal, shader, mix = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("NormalMap", "BsdfPrincipled", "VectorMath"))
    normal.inputs["Color"].default_value = (0.6, 0.45, 0.9, 1)
    mix.operation = "MULTIPLY"
    for source, target in (
        (coordinates.outputs["UV"], checker.inputs["Vector"]),
        (coordinates.outputs["Generated"], noise.inputs["Vector"]),
        (noise.outputs[0], bump.inputs["Height"]),
        (normal.outputs[0], bump.inputs["Normal"]),
        (checker.outputs["Color"], mix.inputs[0]),
        (info.outputs["Color"], mix.inputs[1]),
        (mix.outputs[0], shader.inputs["Base Color"]),
        (info.outputs["Random"], shader.inputs["Roughness"]),
        (bump.outputs[0], shader.inputs["Normal"]),
        (shader.outputs[0], tree.nodes["Material Output"].inputs["Surface"]),
    ):
        tree.links.new(source, target)
    thing.data.materials.append(material)
    return thing


def link(thing: bpy.types.Object, **attributes: object) -> bpy.types.Object:
    bpy.context.scene.collection.objects.link(thing)
    for name, value in attributes.items():
        setattr(thing, name, value)
    return thing


def duplicates(thing: bpy.types.Object) -> None:
    """Duplicates: mirrored, stretched, and hidden from some rays."""
    for x, scale in ((1.2, (-1, 1, 1)), (-1.2, (0.5, 1.5, 1)), (2.4, (1, -0.3, -1))):
        link(thing.copy(), location=(x, x / 4, 0), scale=scale, visible_glossy=x > 0, color=(1, x / 3, 0.5, 1))


def nested(thing: bpy.types.Object) -> None:
    """A mirrored collection of turned collections."""
    inner, outer = bpy.data.collections.new("Inner"), bpy.data.collections.new("Outer")
    inner.objects.link(thing)
    bpy.context.scene.collection.objects.unlink(thing)
    for x in (-0.6, 0.5):
        one = bpy.data.objects.new("One", None)
        one.instance_type, one.instance_collection = "COLLECTION", inner
        one.location, one.rotation_euler, one.scale = (x, 0, x), (x, 1, 0), (1, 0.8, 1.1)
        outer.objects.link(one)
    for y, scale in ((-0.5, (1, 1, 1)), (0.7, (-1, 0.6, 1))):
        link(bpy.data.objects.new("All", None), instance_type="COLLECTION", instance_collection=outer, location=(0, y, 0), scale=scale)


def on_faces(thing: bpy.types.Object) -> None:
    bpy.ops.mesh.primitive_cube_add(size=1.5)
    parent = bpy.context.object
    parent.instance_type, thing.parent, parent.use_instance_faces_scale = "FACES", parent, True
    parent.show_instancer_for_render = False


def by_particles(thing: bpy.types.Object) -> None:
    bpy.ops.mesh.primitive_plane_add(size=2)
    emitter = bpy.context.object
    emitter.modifiers.new("Particles", "PARTICLE_SYSTEM")
    settings = emitter.particle_systems[0].settings
    settings.type, settings.count, settings.render_type, settings.instance_object = "HAIR", 5, "OBJECT", thing
    emitter.show_instancer_for_render = False


def by_geometry_nodes(thing: bpy.types.Object) -> None:
    group = bpy.data.node_groups.new("Balls on a grid", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    grid, ball, spread, end = (
        group.nodes.new(kind)
        for kind in ("GeometryNodeMeshGrid", "GeometryNodeObjectInfo", "GeometryNodeInstanceOnPoints", "NodeGroupOutput")
    )
    ball.inputs["Object"].default_value, ball.inputs["As Instance"].default_value = thing, True
    spread.inputs["Scale"].default_value, spread.inputs["Rotation"].default_value = (1, 0.6, 1), (0.3, 0, 1)
    grid.inputs["Vertices X"].default_value, grid.inputs["Vertices Y"].default_value = 2, 3
    group.links.new(grid.outputs["Mesh"], spread.inputs["Points"])
    group.links.new(ball.outputs["Geometry"], spread.inputs["Instance"])
    group.links.new(spread.outputs["Instances"], end.inputs["Geometry"])
    holder = link(bpy.data.objects.new("Holder", bpy.data.meshes.new("Holder")))
    holder.modifiers.new("Nodes", "NODES").node_group = group


def of(scene: SceneData, index: int) -> tuple[np.ndarray, ...]:
    """All data of an object, in a scene without instances."""
    own = np.flatnonzero(scene.object == index)
    rows = scene.attribute_rows[:, index]
    attributes = np.stack([scene.attributes[row : row + len(own)] for row in rows])
    numbers = np.array([scene.visibility[index], *scene.material[own]])
    return scene.vertices[scene.triangles[own]], scene.normals[own], attributes, scene.object_attributes[:, index], numbers


@pytest.mark.parametrize("arrange", [duplicates, nested, on_faces, by_particles, by_geometry_nodes])
def test_instances_have_all_that_copies_have(both: Callable, thing: bpy.types.Object, arrange: Things):
    arrange(thing)
    kept, copied = both()
    assert len(kept.instances) >= 4
    assert len(kept.triangles) < len(copied.triangles) / 2
    assert [shader.name for shader in kept.shaders] == [shader.name for shader in copied.shaders]
    assert kept.coverage == copied.coverage
    flat = flattened(kept)
    assert len(flat.visibility) == len(copied.visibility)
    middles = [
        np.stack([s.vertices[s.triangles[s.object == o]].mean(axis=(0, 1)) for o in range(len(s.visibility))]) for s in (flat, copied)
    ]
    for index, place in enumerate(middles[1]):
        twin = int(np.linalg.norm(middles[0] - place, axis=1).argmin())
        for ours, theirs in zip(of(flat, twin), of(copied, index), strict=True):
            np.testing.assert_allclose(ours, theirs, atol=1e-5)


def test_instances_look_like_copies(both: Callable, thing: bpy.types.Object, scene: bpy.types.Scene):
    """The instances are smooth, mirrored and turned, with bumps, normal maps and object colours, and shadow each other."""
    duplicates(thing)
    for other in bpy.data.objects:
        if other.type == "MESH":
            other.scale = [np.sign(s) * 1.1 for s in other.scale]
    scene.camera.location, scene.camera.rotation_euler = (0.5, -5, 0.5), (1.5, 0, 0)
    scene.render.resolution_x = scene.render.resolution_y = 48
    light = link(bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT")), location=(-6, -3, 2))
    light.data.energy, light.data.shadow_soft_size = 800, 0.5
    kept, copied = both()
    ours, theirs = (render(part, Render(spp=64, nee=True, max_bounces=3, passes=True)) for part in (kept, copied))
    hit = theirs.film.layers()["Depth"] > 0
    assert hit.mean() > 0.05
    for name in ("Albedo", "Normal"):
        distance = np.abs(ours.film.layers()[name] - theirs.film.layers()[name]).max(axis=2)
        assert (distance < 2e-3).mean() > 0.99
    assert np.isclose(ours.image, theirs.image, rtol=0.02, atol=1e-3).all(axis=2).mean() > 0.9
    assert ours.image[hit].mean() == pytest.approx(theirs.image[hit].mean(), rel=0.01)
    bare = replace(kept, object_attributes=0 * kept.object_attributes)
    assert not np.allclose(ours.image, render(bare, Render(spp=4, nee=True, max_bounces=3)).image, atol=0.1)  # object colours matter


def test_visibility_is_that_of_each_instance(both: Callable, thing: bpy.types.Object):
    duplicates(thing)
    thing.visible_camera = False
    kept, _ = both()
    assert sorted(kept.visibility) == [VISIBLE - GLOSSY, VISIBLE - CAMERA, VISIBLE, VISIBLE]
    assert len(kept.meshes) == 1


def test_materials_of_objects_make_meshes_of_their_own(both: Callable, thing: bpy.types.Object, new_material: Callable):
    duplicates(thing)
    other = new_material("Other")
    for copy in [o for o in bpy.data.objects if o.type == "MESH"][:2]:
        copy.material_slots[0].link, copy.material_slots[0].material = "OBJECT", other
    kept, _ = both()
    assert len(kept.meshes) == 2
    assert kept.instances.tolist() == [0, 0, 1, 1]


def test_meshes_that_shine_are_copied(both: Callable, thing: bpy.types.Object):
    duplicates(thing)
    shader = next(node for node in thing.data.materials[0].node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Emission Color"].default_value, shader.inputs["Emission Strength"].default_value = (1, 1, 1, 1), 1
    kept, copied = both()
    assert kept.key == copied.key


def test_meshes_with_coordinates_of_other_objects_are_copied(both: Callable, thing: bpy.types.Object):
    duplicates(thing)
    coordinates = next(node for node in thing.data.materials[0].node_tree.nodes if node.type == "TEX_COORD")
    coordinates.object = link(bpy.data.objects.new("Other", None), location=(1, 2, 3))
    tree = thing.data.materials[0].node_tree
    tree.links.new(coordinates.outputs["Object"], next(node for node in tree.nodes if node.type == "TEX_CHECKER").inputs["Vector"])
    kept, copied = both()
    assert kept.key == copied.key


def test_what_is_pressed_flat_is_copied(both: Callable, thing: bpy.types.Object):
    duplicates(thing)
    thing.scale.z = 1e-7
    kept, copied = both()
    assert len(kept.instances) == 3
    assert len(np.unique(kept.object)) == 1
    assert len(kept.visibility) == len(copied.visibility)


def test_where_all_are_pressed_flat_nothing_is_kept_once(both: Callable, thing: bpy.types.Object):
    duplicates(thing)
    for other in bpy.data.objects:
        other.scale.z = 0
    kept, copied = both()
    assert kept.key == copied.key


def test_only_what_saves_much_is_kept_once(run: Export, thing: bpy.types.Object, monkeypatch: pytest.MonkeyPatch):
    duplicates(thing)
    count = len(run().triangles) // 4
    for room, meshes in ((3 * count, 0), (3 * count - 1, 1)):
        monkeypatch.setattr(instances, "COPIES", room)
        assert len(run().meshes) == meshes


def test_a_scene_of_nothing_but_instances(both: Callable, thing: bpy.types.Object):
    by_particles(thing)
    thing.hide_render = True
    kept, copied = both()
    assert not len(kept.object)
    np.testing.assert_allclose(flattened(kept).bounds, copied.bounds, atol=1e-5)
    assert np.isfinite(render(kept, Render(spp=1)).image).all()


def test_meshes_none_of_whose_instances_can_be_read_are_left_out(both: Callable, thing: bpy.types.Object):
    """The unreadable meshes are before and after a sound mesh, which is exported."""
    tree, left_out = thing.data.materials[0].node_tree, []
    attribute = node(tree, "ShaderNodeAttribute", into=tree.nodes["Principled BSDF"].inputs["Metallic"], output="Fac")
    attribute.attribute_type, attribute.attribute_name = "OBJECT", "tint"
    for value in (np.inf, 0.5, np.inf):
        mesh = thing.data.copy()
        mesh.uv_layers[0].uv[7].vector.x = min(value, 9)
        for _ in range(3):
            one = link(thing.copy(), data=mesh)
            one["tint"] = value
            left_out += [one.name] if value == np.inf else []
    bpy.data.objects.remove(thing)
    kept, copied = both()
    assert sorted(loss.object for loss in kept.coverage) == left_out
    assert kept.coverage == copied.coverage
    assert (len(kept.meshes), len(kept.instances)) == (1, 3)
    for ours, theirs in zip(of(flattened(kept), 2), of(copied, 2), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-5)


def test_a_mesh_that_fails_while_it_is_kept_is_left_out(run: Export, thing: bpy.types.Object, monkeypatch: pytest.MonkeyPatch):
    def fails(*_: object) -> None:
        raise TypeError("no map")

    duplicates(thing)
    monkeypatch.setattr(instances, "COPIES", 0)
    monkeypatch.setitem(attributes._READERS, "UV", fails)
    exported = run()
    assert [line.partition(":")[2] for line in lines(exported)[:-1]] == [" left out, as it cannot be read: TypeError: no map"] * 4
    assert (len(exported.meshes), len(exported.vertices)) == (0, 0)


def test_an_instance_that_cannot_be_placed_is_left_out(both: Callable, thing: bpy.types.Object):
    duplicates(thing)
    thing.location.x = 1e20
    kept, copied = both()
    assert lines(kept) == lines(copied) == ["Ball, : left out, as it cannot be read: its transform is out of range"]
    assert len(kept.instances) == 3
