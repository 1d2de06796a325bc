"""Meshes, instances, normals and material slots are exported as in a render, each exactly once."""

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from blender_rl_guiding.scene.data import SceneData

Export = Callable[[], SceneData]


def cube(name: str = "Cube", location: tuple[float, float, float] = (0, 0, 0)) -> bpy.types.Object:
    bpy.ops.mesh.primitive_cube_add(size=2, location=location)
    bpy.context.object.name = name
    return bpy.context.object


@pytest.fixture
def diffuse(new_material: Callable[[str], bpy.types.Material]) -> Callable[[str, float], bpy.types.Material]:
    """Makes supported materials of different greys."""

    def make(name: str, value: float) -> bpy.types.Material:
        material = new_material(name)
        tree = material.node_tree
        shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
        shader.inputs["Color"].default_value = (value, value, value, 1)
        tree.links.new(shader.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
        return material

    return make


def duplicate(thing: bpy.types.Object, **places: object) -> bpy.types.Object:
    other = bpy.data.objects.new(thing.name, thing.data)
    bpy.context.scene.collection.objects.link(other)
    for name, value in places.items():
        setattr(other, name, value)
    return other


def face_normals(scene: SceneData) -> np.ndarray:
    a, b, c = (scene.vertices[scene.triangles[:, i]].astype(float) for i in range(3))
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def assert_outwards(scene: SceneData) -> None:
    """Winding and normals of a convex solid around the origin point outwards."""
    middle = scene.vertices[scene.triangles].mean(axis=1)
    assert (np.einsum("ij,ij->i", face_normals(scene), middle) > 0).all()
    assert (np.einsum("ijk,ik->ij", scene.normals, middle) > 0).all()


def test_a_mesh_is_exported_in_world_space(run: Export):
    cube(location=(1, 2, 3))
    scene = run()
    assert len(scene.triangles) == 12
    assert np.allclose(scene.bounds, [(0, 1, 2), (2, 3, 4)])
    assert scene.coverage == ()
    assert scene.vertices.dtype == np.float32


def test_linked_duplicates_are_read_once_and_placed_each(run: Export):
    duplicate(cube(), location=(5, 0, 0))
    scene = run()
    assert len(scene.triangles) == 24
    assert np.allclose(scene.bounds, [(-1, -1, -1), (6, 1, 1)])


def test_collection_instances_are_flattened(run: Export):
    thing, collection = cube(), bpy.data.collections.new("Group")
    collection.objects.link(thing)
    bpy.context.scene.collection.objects.unlink(thing)
    for x in (-10, 10):
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection, empty.location.x = "COLLECTION", collection, x
        bpy.context.scene.collection.objects.link(empty)
    scene = run()
    assert len(scene.triangles) == 24
    assert np.allclose(scene.bounds, [(-11, -1, -1), (11, 1, 1)])


def test_objects_and_collections_of_a_library_are_exported_with_what_is_changed_of_them(run: Export, diffuse: Callable, tmp_path: Path):
    thing, collection = cube("Own"), bpy.data.collections.new("Group")
    thing.data.materials.append(diffuse("Paint", 0.5))
    collection.objects.link(thing)
    library = str(tmp_path / "ein Ordner" / "Bücherei.blend")
    Path(library).parent.mkdir()
    bpy.data.libraries.write(library, {collection})
    bpy.data.batch_remove([collection, thing.data.materials[0], thing.data])
    with bpy.data.libraries.load(library, link=True) as (_, linked):
        linked.objects, linked.collections = ["Own"], ["Group"]
    empty = bpy.data.objects.new("Instance", None)
    empty.instance_type, empty.instance_collection, empty.location.x = "COLLECTION", linked.collections[0], 10
    bpy.context.scene.collection.objects.link(empty)
    own = linked.objects[0].override_create()
    own.location.x = -10
    bpy.context.scene.collection.objects.link(own)
    scene = run()
    assert len(scene.triangles) == 24
    assert np.allclose(scene.bounds, [(-11, -1, -1), (11, 1, 1)])
    assert len(scene.shaders) == 1
    assert scene.coverage == ()


def test_particle_instances_are_exported_without_their_hidden_emitter(run: Export):
    thing = cube()
    bpy.ops.mesh.primitive_plane_add()
    emitter = bpy.context.object
    emitter.modifiers.new("Particles", "PARTICLE_SYSTEM")
    settings = emitter.particle_systems[0].settings
    settings.type, settings.count, settings.render_type, settings.instance_object = "HAIR", 5, "OBJECT", thing
    emitter.show_instancer_for_render = False
    assert len(run().triangles) == 12 * 6
    emitter.show_instancer_for_render = True
    assert len(run().triangles) == 12 * 6 + 2


def add_tube() -> None:
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.bevel_depth = 0.1


@pytest.mark.parametrize(
    "add", [bpy.ops.object.text_add, bpy.ops.object.metaball_add, bpy.ops.surface.primitive_nurbs_surface_torus_add, add_tube]
)
def test_other_objects_with_a_surface_are_exported_once(run: Export, add: Callable):
    add()
    scene = run()
    corners = scene.vertices[scene.triangles].reshape(-1, 9)
    assert len(corners) > 50
    assert len(np.unique(corners, axis=0)) == len(corners)


def test_flat_faces_have_their_own_normals(run: Export):
    cube()
    scene = run()
    assert np.allclose(scene.normals, face_normals(scene)[:, None, :], atol=1e-6)


def test_smooth_faces_share_those_of_the_vertices(run: Export):
    cube().data.shade_smooth()
    scene = run()
    corners = scene.vertices[scene.triangles]
    assert np.allclose(scene.normals, corners / np.sqrt(3), atol=1e-6)


def test_sharp_edges_and_custom_normals(run: Export):
    thing = cube()
    thing.data.shade_smooth()
    for edge in thing.data.edges:
        edge.use_edge_sharp = True
    scene = run()
    assert np.allclose(scene.normals, face_normals(scene)[:, None, :], atol=1e-6)
    thing.data.normals_split_custom_set([(0, 0.6, 0.8)] * 24)
    assert np.allclose(run().normals, (0, 0.6, 0.8), atol=1e-3)  # Blender keeps custom normals in 16 bits


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("scale", [(-1, 1, 1), (-1, -2, -3), (3, 1, 0.5), (-1, -1, 1)])
def test_normals_and_winding_stay_outwards_whatever_the_scale(run: Export, scale: tuple[float, float, float], smooth: bool):
    thing = cube()
    thing.scale, thing.rotation_euler = scale, (0.3, 0.5, 0.7)
    if smooth:
        thing.data.shade_smooth()
    scene = run()
    assert_outwards(scene)
    assert np.allclose(np.linalg.norm(scene.normals, axis=2), 1, atol=1e-6)
    if not smooth:
        assert np.allclose(scene.normals, face_normals(scene)[:, None, :], atol=1e-5)


def test_modifiers_are_applied_at_render_level(run: Export):
    subdivision = cube().modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 0, 2
    assert len(run().triangles) == 12 * 4**2


def test_only_what_renders_is_exported(run: Export):
    cube("shown", (0, 0, 0)).hide_viewport = True
    cube("hidden", (9, 0, 0)).hide_render = True
    scene = run()
    assert len(scene.triangles) == 12
    assert scene.bounds[1][0] == 1


def test_each_face_has_the_material_of_its_slot(run: Export, diffuse: Callable):
    thing = cube()
    for value in (0.1, 0.2, 0.3):
        thing.data.materials.append(diffuse(f"{value}", value))
    thing.data.polygons[2].material_index = 1
    scene = run()
    assert [shader.name for shader in scene.shaders] == ["0.1", "0.2"]  # no face has the third
    assert np.bincount(scene.material).tolist() == [10, 2]


def test_materials_linked_to_the_object_win(run: Export, diffuse: Callable):
    first = cube()
    first.data.materials.append(diffuse("mesh", 0.1))
    second = duplicate(first, location=(5, 0, 0))
    second.material_slots[0].link = "OBJECT"
    second.material_slots[0].material = diffuse("object", 0.2)
    scene = run()
    of = {m.name: scene.vertices[scene.triangles[scene.material == i]].mean(axis=(0, 1))[0] for i, m in enumerate(scene.shaders)}
    assert of == pytest.approx({"mesh": 0, "object": 5})


def test_an_index_beyond_the_slots_takes_the_last(run: Export, diffuse: Callable):
    thing = cube()
    thing.data.materials.append(diffuse("only", 0.1))
    thing.data.polygons[0].material_index = 7
    assert [shader.name for shader in run().shaders] == ["only"]


def test_loose_vertices_do_not_widen_the_scene(run: Export):
    thing = cube()
    thing.data.vertices.add(1)
    thing.data.vertices[8].co = (100, 0, 0)
    scene = run()
    assert scene.bounds[1][0] == 1
    assert len(scene.vertices) == 8
    assert_outwards(scene)


def test_an_object_without_faces_leaves_no_trace(run: Export):
    cube()
    bpy.ops.mesh.primitive_circle_add()
    scene = run()
    assert len(scene.triangles) == 12
    assert scene.coverage == ()


def test_the_triangles_are_those_that_blender_shows(run: Export):
    """The exporter reads triangles from Blender's memory. The slow, official way gives the same triangles."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=9, ring_count=5)
    mesh = bpy.context.object.data
    mesh.calc_loop_triangles()
    expected = [[tuple(mesh.vertices[i].co) for i in triangle.vertices] for triangle in mesh.loop_triangles]
    scene = run()
    assert np.allclose(scene.vertices[scene.triangles], expected)


def test_a_flattened_object_has_normals_still(run: Export):
    cube().scale = (1, 1, 0)
    scene = run()
    assert len(scene.triangles) == 4
    assert np.allclose(np.abs(scene.normals), (0, 0, 1))


def test_the_triangles_of_an_object_follow_each_other(run: Export):
    duplicate(cube(), location=(5, 0, 0))
    scene = run()
    assert scene.object.tolist() == [0] * 12 + [1] * 12
    assert len(scene.visibility) == 2
    middles = [scene.vertices[scene.triangles[scene.object == i]].mean(axis=(0, 1))[0] for i in range(2)]
    assert sorted(middles) == pytest.approx([0, 5])


def test_a_family_of_metaballs_is_one_mesh(run: Export):
    bpy.ops.object.metaball_add(location=(0, 0, 0))
    one = run()
    bpy.ops.object.metaball_add(location=(0.5, 0, 0))
    both = run()
    assert len(both.visibility) == 1
    assert both.bounds[1][0] > one.bounds[1][0]


def test_instances_of_geometry_nodes(run: Export):
    group = bpy.data.node_groups.new("Grid of cubes", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    grid, box, spread, end = (
        group.nodes.new(kind)
        for kind in ("GeometryNodeMeshGrid", "GeometryNodeMeshCube", "GeometryNodeInstanceOnPoints", "NodeGroupOutput")
    )
    group.links.new(grid.outputs["Mesh"], spread.inputs["Points"])
    group.links.new(box.outputs["Mesh"], spread.inputs["Instance"])
    group.links.new(spread.outputs["Instances"], end.inputs["Geometry"])
    grid.inputs["Vertices X"].default_value, grid.inputs["Vertices Y"].default_value = 2, 3
    cube().modifiers.new("Nodes", "NODES").node_group = group
    scene = run()
    assert len(scene.visibility) == 6
    assert len(scene.triangles) == 6 * 12


def test_instances_on_vertices(run: Export):
    child = cube("Child")
    bpy.ops.mesh.primitive_plane_add(size=10)
    parent = bpy.context.object
    parent.instance_type, child.parent = "VERTS", parent
    assert len(run().visibility) == 5  # the plane, and a cube at each of its vertices; the instanced cube itself is hidden
