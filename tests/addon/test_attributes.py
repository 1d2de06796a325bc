"""Attributes of meshes and objects have Cycles' values."""

from collections.abc import Callable
from pathlib import Path

import bpy
import mathutils  # pyright: ignore[reportMissingImports]  # a part of bpy
import numpy as np
import pytest

from addon.export.geometry import loop_triangles, read_array, read_mesh
from addon.export.tangents import tangents
from blender_rl_guiding.scene.data import SceneData

Export = Callable[[], SceneData]
Source = Callable[[bpy.types.NodeTree], bpy.types.NodeSocket]  # makes nodes, and returns the output to compare
TRIANGLE = 3  # the triangle that is compared
SHIFT = 10.0  # added, because light cannot be negative


def node(kind: str, output: str, **settings: object) -> Source:
    def make(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        new = tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(new, name, value)
        return new.outputs[output]

    return make


def coordinates(output: str, **settings: object) -> Source:
    return node("ShaderNodeTexCoord", output, **settings)


def attribute(name: str, output: str = "Vector") -> Source:
    return node("ShaderNodeAttribute", output, attribute_name=name)


@pytest.fixture
def thing(scene: bpy.types.Scene) -> bpy.types.Object:
    """A twisted, turned and stretched cube of triangles, with attributes of all kinds."""
    bpy.ops.mesh.primitive_cube_add(location=(1, 2, 0.5), rotation=(0.2, 0.3, 0.4), scale=(1, 2, 0.7))
    thing = bpy.context.object
    thing.name, thing.color, thing.pass_index = "Würfel", (0.1, 0.2, 0.3, 0.4), 7
    twist = thing.modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle, twist.deform_axis = "TWIST", 1, "Z"
    thing.modifiers.new("Triangles", "TRIANGULATE")
    other = bpy.data.objects.new("Other", None)
    other.location, other.rotation_euler, other.scale = (1, 0, 1), (1, 0.3, 0), (1, 1.3, 0.5)
    scene.collection.objects.link(other)
    return thing


def add_attribute(mesh: bpy.types.Mesh, kind: str, domain: str) -> None:
    new = mesh.attributes.new("values", kind, domain)
    field = next(name for name in ("color", "vector", "value") if hasattr(new.data[0], name))
    size = np.size(getattr(new.data[0], field))
    numbers = np.random.default_rng(2).integers(0, 2, len(new.data) * size)
    if kind not in ("INT", "INT8", "BOOLEAN"):
        numbers = np.random.default_rng(2).random(len(new.data) * size)
    new.data.foreach_set(field, numbers.astype({"INT": np.int32, "INT8": np.int32, "BOOLEAN": bool}.get(kind, np.float32)))


@pytest.fixture
def paint(new_material: Callable[[str], bpy.types.Material]) -> Callable[[bpy.types.Object, Source], None]:
    """Makes an object emit the source's value plus SHIFT."""

    def go(thing: bpy.types.Object, source: Source) -> None:
        material = new_material("Glow")
        tree = material.node_tree
        emission, shifted = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeVectorMath")
        shifted.inputs[1].default_value = (SHIFT,) * 3
        tree.links.new(source(tree), shifted.inputs[0])
        tree.links.new(shifted.outputs["Vector"], emission.inputs["Color"])
        tree.links.new(emission.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
        thing.data.materials.clear()
        thing.data.materials.append(material)

    return go


def seen_by_cycles(exported: SceneData, scene: bpy.types.Scene, path: Path) -> np.ndarray:
    """Cycles' value at the middle of the triangle."""
    corners = exported.vertices[exported.triangles[TRIANGLE]].astype(float)
    normal = mathutils.Vector(np.cross(corners[1] - corners[0], corners[2] - corners[0])).normalized()
    camera, cycles, render = scene.camera, scene.cycles, scene.render
    place = mathutils.Vector(corners.mean(axis=0)) + 0.01 * normal
    camera.matrix_world = mathutils.Matrix.LocRotScale(place, normal.to_track_quat("Z", "Y"), None)
    camera.data.type, camera.data.ortho_scale, camera.data.clip_start = "ORTHO", 1e-4, 1e-3
    cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = 1, False, False
    render.engine, render.filepath = "CYCLES", str(path / "middle.exr")
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath)
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(-1, image.channels)[:, :3].mean(axis=0) - SHIFT


def exported_there(exported: SceneData) -> np.ndarray:
    """The value of the scene's only attribute, at the middle of the first object's triangle TRIANGLE."""
    if len(exported.object_attributes):
        return exported.object_attributes[0, 0]
    ((row,),) = exported.attribute_rows
    return exported.attributes[row + TRIANGLE].mean(axis=0)


@pytest.fixture
def assert_agrees(run: Export, scene: bpy.types.Scene, paint: Callable, tmp_path: Path) -> Callable[[bpy.types.Object, Source], None]:
    def check(thing: bpy.types.Object, source: Source) -> None:
        paint(thing, source)
        exported = run()
        assert exported_there(exported) == pytest.approx(seen_by_cycles(exported, scene, tmp_path), abs=2e-4)

    return check


@pytest.mark.parametrize("output", ["UV", "Generated", "Object"])
@pytest.mark.parametrize("mirrored", [False, True])
def test_coordinates(thing: bpy.types.Object, assert_agrees: Callable, output: str, mirrored: bool):
    thing.scale.x *= -1 if mirrored else 1
    assert_agrees(thing, coordinates(output))


def test_coordinates_of_another_object(thing: bpy.types.Object, assert_agrees: Callable):
    assert_agrees(thing, coordinates("Object", object=bpy.data.objects["Other"]))


def test_a_texture_space_of_the_user(thing: bpy.types.Object, assert_agrees: Callable):
    thing.data.use_auto_texspace = False
    thing.data.texspace_location, thing.data.texspace_size = (0.1, 0.2, 0.3), (2, 0.5, 1)
    assert_agrees(thing, coordinates("Generated"))


@pytest.mark.parametrize(
    ("kind", "domain"),
    [
        ("FLOAT", "POINT"),
        ("FLOAT", "EDGE"),
        ("FLOAT_VECTOR", "FACE"),
        ("FLOAT_COLOR", "CORNER"),
        ("BYTE_COLOR", "POINT"),
        ("FLOAT2", "CORNER"),
        ("INT", "POINT"),
        ("INT8", "CORNER"),
        ("BOOLEAN", "FACE"),
        ("QUATERNION", "POINT"),
    ],
)
def test_named_attributes(thing: bpy.types.Object, assert_agrees: Callable, kind: str, domain: str):
    add_attribute(thing.data, kind, domain)
    assert_agrees(thing, attribute("values"))


@pytest.mark.parametrize("kind", ["FLOAT_COLOR", "FLOAT"])
def test_alphas(thing: bpy.types.Object, assert_agrees: Callable, kind: str):
    add_attribute(thing.data, kind, "POINT")
    assert_agrees(thing, attribute("values", "Alpha"))


def test_the_colour_attribute_for_rendering(thing: bpy.types.Object, assert_agrees: Callable):
    add_attribute(thing.data, "FLOAT_COLOR", "CORNER")
    thing.data.color_attributes.render_color_index = 0
    assert_agrees(thing, node("ShaderNodeVertexColor", "Color"))


@pytest.mark.parametrize("output", ["Random", "Color", "Alpha", "Object Index", "Location"])
def test_object_info(thing: bpy.types.Object, assert_agrees: Callable, output: str):
    assert_agrees(thing, node("ShaderNodeObjectInfo", output))


@pytest.mark.parametrize("output", ["Random", "Color", "Location"])
def test_object_info_of_instances(thing: bpy.types.Object, scene: bpy.types.Scene, assert_agrees: Callable, output: str):
    collection, empty = bpy.data.collections.new("Group"), bpy.data.objects.new("Instance", None)
    collection.objects.link(thing)
    scene.collection.objects.unlink(thing)
    empty.instance_type, empty.instance_collection, empty.location.x, empty.color = "COLLECTION", collection, 3, (0.9, 0.8, 0.7, 1)
    scene.collection.objects.link(empty)
    assert_agrees(thing, node("ShaderNodeObjectInfo", output))


@pytest.mark.parametrize("add", [bpy.ops.object.text_add, bpy.ops.object.metaball_add, bpy.ops.surface.primitive_nurbs_surface_torus_add])
def test_generated_coordinates_of_what_is_no_mesh(scene: bpy.types.Scene, assert_agrees: Callable, add: Callable):
    add()
    assert_agrees(bpy.context.object, coordinates("Generated"))


@pytest.mark.parametrize(("axis", "i", "j"), [("X", 1, 2), ("Y", 2, 0), ("Z", 0, 1)])
def test_radial_tangents(run: Export, scene: bpy.types.Scene, paint: Callable, axis: str, i: int, j: int):
    bpy.ops.mesh.primitive_cube_add()
    thing = bpy.context.object
    thing.scale = (1, 2, 4)
    paint(thing, node("ShaderNodeTangent", "Tangent", direction_type="RADIAL", axis=axis))
    exported = run()
    local = exported.vertices[exported.triangles] / (1, 2, 4)
    expected = np.zeros((12, 3, 3))
    sense = -1 if axis == "Y" else 1  # as in Cycles
    expected[..., i], expected[..., j] = -sense * local[..., j] / 2, sense * local[..., i] / 2  # generated coordinates have half the size
    assert exported.attributes == pytest.approx(expected, abs=1e-6)
    assert exported.object_attributes == pytest.approx(np.diag(1 / np.array((1, 2, 4)))[:, None], abs=1e-6)


def test_what_a_mesh_lacks_has_no_rows(run: Export, thing: bpy.types.Object, paint: Callable):
    paint(thing, attribute("nothing"))
    assert run().attribute_rows.tolist() == [[-1]]


def test_only_the_objects_that_ask_bring_rows_and_instances_share_them(run: Export, thing: bpy.types.Object, paint: Callable):
    paint(thing, coordinates("UV"))
    for x in (5, 10):
        other = bpy.data.objects.new("Same", thing.data)
        other.location.x = x
        bpy.context.scene.collection.objects.link(other)
    bpy.ops.mesh.primitive_cube_add()  # a cube without a material
    exported = run()
    assert sorted(exported.attribute_rows[0].tolist()) == [-1, 0, 12, 12]  # the first has modifiers, so it has its own mesh
    assert len(exported.attributes) == 24


def test_triangles_without_area_have_no_rows(run: Export, thing: bpy.types.Object, paint: Callable):
    mesh = bpy.data.meshes.new("Pole")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (2, 0, 0), (1, 1, 0), (2, 1, 0)], [], [(0, 1, 2), (0, 1, 3), (1, 2, 4)])
    thing.modifiers.clear()
    thing.data = mesh
    thing.data.attributes.new("values", "FLOAT", "FACE").data.foreach_set("value", np.float32([1, 2, 3]))
    paint(thing, attribute("values"))
    assert run().attributes.tolist() == [[[2] * 3] * 3, [[3] * 3] * 3]


def test_what_an_instance_without_area_lacks_is_not_taken_from_the_others(run: Export, thing: bpy.types.Object, paint: Callable):
    thing.modifiers.clear()
    thing.scale.z = 0.0
    paint(thing, coordinates("UV"))
    whole = bpy.data.objects.new("Whole", thing.data)
    bpy.context.scene.collection.objects.link(whole)
    exported = run()
    assert len(exported.triangles) < 24
    assert len(exported.attributes) == len(exported.triangles)


@pytest.mark.parametrize("smooth", [False, True])
def test_tangents_are_those_of_mikktspace(scene: bpy.types.Scene, smooth: bool):
    """On triangles Blender computes the same tangents. Cycles, too, gives triangles to MikkTSpace."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
    thing = bpy.context.object
    if smooth:
        thing.data.shade_smooth()
    thing.data.calc_tangents(uvmap=thing.data.uv_layers[0].name)
    loops, mesh = loop_triangles(thing.data), read_mesh(thing.data)
    uvs = read_array(thing.data.uv_layers[0].uv, "vector", (2,), np.float32)[loops]
    directions, signs = tangents(mesh.vertices[mesh.corners], mesh.normals[mesh.normal], uvs)
    assert directions == pytest.approx(read_array(thing.data.loops, "tangent", (3,), np.float32)[loops], abs=1e-5)
    assert (read_array(thing.data.loops, "bitangent_sign", (), np.float32)[loops] == signs[:, None]).all()


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (2, 1, 0.5)])
def test_tangents_in_the_space_of_the_object_follow_u_and_their_signs_v(
    run: Export, thing: bpy.types.Object, paint: Callable, scale: tuple
):
    normal_map = node("ShaderNodeNormalMap", "Normal")
    thing.scale = scale
    paint(thing, normal_map)
    exported = run()
    tangent, sign, normal = (exported.attributes[row : row + 12] for row in exported.attribute_rows[:, 0])
    paint(thing, coordinates("UV"))
    uv = run().attributes
    corners = (exported.vertices[exported.triangles].astype(float) - thing.location) @ np.array(thing.rotation_euler.to_matrix()) / scale
    edges, (u, v) = corners[:, 1:] - corners[:, :1], np.moveaxis(uv[:, 1:, :2] - uv[:, :1, :2], 2, 0)
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    along_u = (v[:, 1, None] * edges[:, 0] - v[:, 0, None] * edges[:, 1]) / area[:, None]
    along_v = (u[:, 0, None] * edges[:, 1] - u[:, 1, None] * edges[:, 0]) / area[:, None]
    assert (np.einsum("ti,tci->tc", along_u, tangent) > 0).all()
    bitangent = sign * np.cross(normal, tangent)
    assert (np.einsum("ti,tci->tc", along_v, bitangent) > 0).all()
    assert np.linalg.norm(tangent, axis=2) == pytest.approx(1, abs=1e-5)
