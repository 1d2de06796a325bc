"""All kinds of objects give triangles or nothing. Objects that cannot be read are left out, and listed by name."""

import math
from collections.abc import Callable

import bpy
import numpy as np
import pytest

from addon.export import attributes
from blender_rl_guiding.scene.data import SceneData
from tests.addon.trees import lines, node, put

Export = Callable[[], SceneData]


@pytest.fixture
def plane(scene: bpy.types.Scene) -> bpy.types.Object:
    bpy.ops.mesh.primitive_plane_add()
    return bpy.context.object


# --- kinds of objects ------------------------------------------------------------------------------------------------


def _mesh(vertices: int, *, edges: int = 0, faces: int = 0) -> Callable[[], None]:
    """A mesh of vertices on a circle, with `edges` edges and at most one face."""

    def add() -> None:
        circle = [(math.cos(i), math.sin(i), 0) for i in range(vertices)]
        mesh = bpy.data.meshes.new("Mesh")
        mesh.from_pydata(circle, [(i, i + 1) for i in range(edges)], [range(vertices)] * faces)
        _link(mesh)

    return add


def _link(data: bpy.types.ID | None) -> bpy.types.Object:
    thing = bpy.data.objects.new("Thing", data)
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    return thing


def _nodes(kind: str) -> Callable[[], None]:
    """A plane with a modifier that turns it into something else."""

    def add() -> None:
        bpy.ops.mesh.primitive_plane_add()
        tree = bpy.data.node_groups.new("Geometry", "GeometryNodeTree")
        for direction in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
        start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
        if kind:
            middle = tree.nodes.new(f"GeometryNode{kind}")
            tree.links.new(start.outputs[0], middle.inputs[0])
            tree.links.new(middle.outputs[0], end.inputs[0])
        bpy.context.object.modifiers.new("Geometry", "NODES").node_group = tree

    return add


def _curve(kind: str, depth: float) -> Callable[[], None]:
    def add() -> None:
        getattr(bpy.ops.curve, f"primitive_{kind}_add")()
        bpy.context.object.data.bevel_depth = depth

    return add


GREASE_PENCILS = "grease_pencils" if bpy.app.version >= (5, 0) else "grease_pencils_v3"
# (function that makes the object, whether the object gives triangles, whether the coverage list names it).
KINDS: dict[str, tuple[Callable[[], object], bool, bool]] = {
    "no vertices": (_mesh(0), False, False),
    "one vertex": (_mesh(1), False, False),
    "loose vertices": (_mesh(3), False, False),
    "edges": (_mesh(3, edges=2), False, False),
    "a face": (_mesh(5, faces=1), True, False),
    "a face and edges": (_mesh(5, edges=2, faces=1), True, False),
    "nodes that make nothing": (_nodes(""), False, False),
    "nodes that make points": (_nodes("MeshToPoints"), False, True),
    "nodes that make curves": (_nodes("MeshToCurve"), False, False),
    "nodes that make a hull": (_nodes("ConvexHull"), True, False),
    "wire": (_curve("bezier_curve", 0.0), False, False),
    "tube": (_curve("bezier_circle", 0.1), True, False),
    "nurbs wire": (_curve("nurbs_path", 0.0), False, False),
    "empty curve": (lambda: _link(bpy.data.curves.new("Curve", "CURVE")), False, False),
    "surface": (lambda: bpy.ops.surface.primitive_nurbs_surface_sphere_add(), True, False),
    "surface without a face": (lambda: bpy.ops.surface.primitive_nurbs_surface_curve_add(), False, False),
    "text": (lambda: bpy.ops.object.text_add(), True, False),
    "empty text": (lambda: setattr(_link(bpy.data.curves.new("Text", "FONT")).data, "body", ""), False, False),
    "metaball": (lambda: bpy.ops.object.metaball_add(), True, False),
    "metaball without elements": (lambda: _link(bpy.data.metaballs.new("Ball")), False, False),
    "points": (lambda: _link(bpy.data.pointclouds.new("Points")), False, True),
    "hair": (lambda: _link(bpy.data.hair_curves.new("Hair")), False, True),
    "volume": (lambda: _link(bpy.data.volumes.new("Fog")), False, True),
    "grease pencil": (lambda: _link(getattr(bpy.data, GREASE_PENCILS).new("Lines")), False, True),
    "lattice": (lambda: _link(bpy.data.lattices.new("Lattice")), False, False),
    "armature": (lambda: bpy.ops.object.armature_add(), False, False),
    "empty": (lambda: _link(None), False, False),
    "image": (lambda: bpy.ops.object.empty_add(type="IMAGE"), False, False),
    "camera": (lambda: bpy.ops.object.camera_add(), False, False),
    "lamp": (lambda: bpy.ops.object.light_add(), False, False),
    "speaker": (lambda: bpy.ops.object.speaker_add(), False, False),
    "probe": (lambda: bpy.ops.object.lightprobe_add(type="SPHERE"), False, False),
}
EDITABLE = {"MESH", "CURVE", "SURFACE", "META", "FONT", "LATTICE", "ARMATURE"}


def test_each_kind_of_object(run: Export, scene: bpy.types.Scene):
    """Each object is alone in the image, first in object mode, then in edit mode. Its material reads an attribute of the mesh."""
    material = bpy.data.materials.new("Paint")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    node(tree, "ShaderNodeAttribute", into=tree.nodes["Principled BSDF"].inputs["Base Color"]).attribute_name = "position"
    for name, (make, solid, listed) in KINDS.items():
        make()
        thing = bpy.context.view_layer.objects.active
        if hasattr(thing.data, "materials"):
            thing.data.materials.append(material)
        whole = run()
        assert (len(whole.triangles) > 0, [line for line in lines(whole) if "empty" not in line] != []) == (solid, listed), name
        if thing.type in EDITABLE:
            bpy.ops.object.mode_set(mode="EDIT")
            edited = run()
            bpy.ops.object.mode_set(mode="OBJECT")
            assert (len(edited.triangles), lines(edited)) == (len(whole.triangles), lines(whole)), name
            assert np.array_equal(edited.attributes, whole.attributes), name
        bpy.data.objects.remove(thing)


def test_instances_of_a_mesh_in_edit_mode(run: Export, plane: bpy.types.Object):
    _nodes("")()
    tree = bpy.context.object.modifiers[0].node_group
    points = tree.nodes.new("GeometryNodeInstanceOnPoints")
    start, end = (next(n for n in tree.nodes if n.bl_idname == kind) for kind in ("NodeGroupInput", "NodeGroupOutput"))
    for source, target in ((start, points.inputs["Points"]), (start, points.inputs["Instance"]), (points, end.inputs[0])):
        tree.links.new(source.outputs[0], target)
    before = run()
    bpy.ops.object.mode_set(mode="EDIT")
    after = run()
    assert len(before.triangles) == len(after.triangles) == 2 + 4 * 2
    assert lines(after) == []


def test_what_is_changed_in_edit_mode_is_in_the_image(run: Export, plane: bpy.types.Object):
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=3)
    assert len(run().triangles) == 2 * 16
    assert bpy.context.object.mode == "EDIT"


# --- objects that cannot be read -------------------------------------------------------------------------------------


def alone(scene: SceneData, line: str) -> bool:
    """Whether the coverage list has one line, which says that the plane is left out, and the scene has the cube's triangles."""
    return lines(scene) == [f"Plane, : left out, as it cannot be read: {line}"] and len(scene.triangles) == 12


@pytest.fixture
def beside(plane: bpy.types.Object) -> bpy.types.Object:
    """A plane, beside a sound cube."""
    bpy.ops.mesh.primitive_cube_add()
    return plane


@pytest.mark.parametrize("value", [math.nan, math.inf, 3e38])
def test_a_mesh_with_a_vertex_that_is_not_finite(run: Export, beside: bpy.types.Object, value: float):
    positions = np.zeros(12, np.float32)
    beside.data.vertices.foreach_get("co", positions)
    positions[7] = value
    beside.data.vertices.foreach_set("co", positions)
    assert alone(run(), f"vertex 2 is out of range: (-1, {value:g}, 0)")


def test_a_transform_that_is_not_finite(run: Export, beside: bpy.types.Object):
    beside.location.x = math.nan
    assert alone(run(), "its transform is not finite")
    beside.location.x = 1e30
    assert alone(run(), "its transform is out of range")


def test_a_lamp_that_cannot_be_placed(run: Export, beside: bpy.types.Object):
    bpy.data.objects.remove(beside)
    bpy.ops.object.light_add()
    bpy.context.object.location.y = math.nan
    scene = run()
    assert lines(scene) == ["Point, : left out, as it cannot be read: its transform is not finite"]
    assert scene.lamps == ()


def test_a_material_with_a_number_that_is_not_finite(run: Export, beside: bpy.types.Object, paint: bpy.types.Material):
    put(paint, "ShaderNodeBsdfDiffuse").inputs["Color"].default_value[1] = math.nan
    beside.data.materials.append(paint)
    assert alone(run(), "shader 'Paint'.closures[0].inputs.color[1] is nan, which is not a finite number")


def test_an_attribute_with_numbers_that_are_not_finite(run: Export, beside: bpy.types.Object, paint: bpy.types.Material):
    node(paint.node_tree, "ShaderNodeUVMap", into=put(paint, "ShaderNodeBsdfDiffuse").inputs["Color"])
    beside.data.materials.append(paint)
    beside.data.uv_layers[0].uv[1].vector.x = math.nan
    scene = run()
    assert lines(scene) == ["Plane, attribute 'UV': numbers that are not finite: 0 stands in for them"]
    assert len(scene.triangles) == 14


@pytest.mark.parametrize("error", [KeyError("position"), RuntimeError("no data"), ValueError("wrong size")])
def test_whatever_else_blender_says_of_an_object(
    run: Export, beside: bpy.types.Object, paint: bpy.types.Material, error: Exception, monkeypatch: pytest.MonkeyPatch
):
    """The error may also come when half of the object is read."""
    node(paint.node_tree, "ShaderNodeUVMap", into=put(paint, "ShaderNodeBsdfDiffuse").inputs["Color"])
    beside.data.materials.append(paint)

    def fails(*_: object) -> None:
        raise error

    monkeypatch.setitem(attributes._READERS, "UV", fails)
    assert alone(run(), f"{type(error).__name__}: {error}")


# --- nothing to see --------------------------------------------------------------------------------------------------


def test_an_empty_scene_is_rendered_and_listed(run: Export):
    scene = run()
    assert lines(scene) == ["Scene, : the scene is empty: nothing but the world is in the image"]
    assert len(scene.triangles) == len(scene.visibility) == 0


def test_a_dark_scene_is_rendered_and_listed(run: Export, scene: bpy.types.Scene, plane: bpy.types.Object):
    scene.world = None
    assert lines(run()) == ["Scene, : the scene is dark: no lamp, no emitting surface, and the world is black"]
    bpy.ops.object.light_add(type="SUN")
    exported = run()
    assert lines(exported) == []
    assert [lamp.name for lamp in exported.lamps] == ["Sun"]
