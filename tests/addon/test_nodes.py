"""Each node becomes steps of shader code. Groups, reroutes and muted nodes work as in Cycles."""

from typing import Any

import bpy
import pytest

from addon.export.resources import Resources
from blender_rl_guiding.scene.ops import OPS, fault
from tests.addon.trees import color, color_of, node, only, probe, read, surface, tree_of

A, B = (0.25, 0.5, 0.75, 1), (0.5, 0.25, 1, 1)
a, b = A[:3], (0.5, 0.25, 1.0)


@pytest.fixture
def tree(paint: bpy.types.Material) -> bpy.types.NodeTree:
    return paint.node_tree


# --- numbers, vectors and colours ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "properties", "output", "inputs", "expected"),
    [
        ("ShaderNodeMath", {"operation": "SINE"}, 0, {"Value": 2}, ("math", "SINE", (0,), (2.0, 0.0, 0.0))),
        ("ShaderNodeMath", {"operation": "ADD", "use_clamp": True}, 0, {"Value": 2}, ("math", "ADD", (1,), (2.0, 0.5, 0.0))),
        ("ShaderNodeVectorMath", {"operation": "SCALE"}, 0, {"Vector": a, "Scale": 2}, ("vector_math", "SCALE", (a, 0.0, 0.0, 2.0))),
        ("ShaderNodeVectorMath", {"operation": "LENGTH"}, "Value", {"Vector": a}, ("vector_math", "LENGTH", (a, 0.0, 0.0, 0.0))),
        ("ShaderNodeClamp", {"clamp_type": "RANGE"}, 0, {"Value": 2}, ("clamp", "RANGE", (2.0, 0.0, 1.0))),
        ("ShaderNodeMapping", {}, 0, {"Vector": a}, ("mapping", "POINT", (a, (0.0,) * 3, (0.0,) * 3, (1.0,) * 3))),
        (
            "ShaderNodeMapRange",
            {"interpolation_type": "SMOOTHSTEP"},
            0,
            {"Value": 0.5, "To Max": 4},
            ("map_range", "SMOOTHSTEP", (1,), (0.5, 0.0, 1.0, 0.0, 4.0)),
        ),
        (
            "ShaderNodeMapRange",
            {"interpolation_type": "STEPPED", "clamp": False},
            0,
            {"Value": 0.5, "From Max": 2, "To Max": 4},
            (
                "map_range",
                "LINEAR",
                (0,),
                (("steps", (("map_range", "LINEAR", (0,), (0.5, 0.0, 2.0, 0.0, 1.0)), 4.0)), 0.0, 1.0, 0.0, 4.0),
            ),
        ),
        (
            "ShaderNodeMapRange",
            {"data_type": "FLOAT_VECTOR"},
            "Vector",
            {"Vector": a},
            ("map_range", "LINEAR", (1,), (a, (0.0,) * 3, (1.0,) * 3, (0.0,) * 3, (1.0,) * 3)),
        ),
        ("ShaderNodeSeparateXYZ", {}, "Z", {"Vector": a}, ("component", (2,), (a,))),
        ("ShaderNodeCombineXYZ", {}, 0, {"X": 1, "Z": 3}, ("combine", "RGB", (1.0, 0.0, 3.0))),
        ("ShaderNodeSeparateColor", {"mode": "HSV"}, "Green", {"Color": A}, ("component", (1,), (("separate", "HSV", (a,)),))),
        ("ShaderNodeCombineColor", {"mode": "HSL"}, 0, {"Red": 1}, ("combine", "HSL", (1.0, 0.0, 0.0))),
        ("ShaderNodeInvert", {}, 0, {"Color": A}, ("invert", (1.0, a))),
        ("ShaderNodeGamma", {}, 0, {"Color": A, "Gamma": 2}, ("gamma", (a, 2.0))),
        ("ShaderNodeBrightContrast", {}, 0, {"Color": A, "Contrast": 2}, ("bright_contrast", (a, 0.0, 2.0))),
        ("ShaderNodeHueSaturation", {}, 0, {"Color": A, "Saturation": 2}, ("hsv", (0.5, 2.0, 1.0, 1.0, a))),
        ("ShaderNodeRGBToBW", {}, 0, {"Color": A}, ("luminance", (a,))),
        ("ShaderNodeMixRGB", {"use_clamp": True}, 0, {"Color1": A, "Color2": B}, ("mix", "MIX", (1, 1), (0.5, a, b))),
    ],
)
def test_arithmetic(paint: bpy.types.Material, kind: str, properties: dict, output: int | str, inputs: dict, expected: tuple):
    new = paint.node_tree.nodes.new(kind)
    for name, value in properties.items():
        setattr(new, name, value)
    for name, value in inputs.items():
        next(s for s in new.inputs if s.name == name and not s.is_unavailable).default_value = value
    socket = next(s for s in new.outputs if s.name == output) if isinstance(output, str) else new.outputs[output]
    paint.node_tree.links.new(socket, color_of(paint.node_tree))
    assert color(paint) == expected


@pytest.mark.parametrize(
    ("kind", "factor_mode", "mode", "expected"),
    [
        ("FLOAT", "UNIFORM", "MIX", ("mix", "MIX", (1, 0), (0.25, 1.0, 2.0))),
        ("VECTOR", "UNIFORM", "MIX", ("mix", "MIX", (1, 0), (0.25, a, b))),
        ("VECTOR", "NON_UNIFORM", "MIX", ("mix", "MIX", (1, 0), ((0.5, 0.5, 0.5), a, b))),
        ("RGBA", "UNIFORM", "BURN", ("mix", "BURN", (1, 1), (0.25, a, b))),
    ],
)
def test_mix_takes_the_sockets_of_its_type(paint: bpy.types.Material, kind: str, factor_mode: str, mode: str, expected: tuple):
    new = paint.node_tree.nodes.new("ShaderNodeMix")
    new.data_type, new.factor_mode, new.blend_type, new.clamp_result = kind, factor_mode, mode, True
    sockets = {"Factor_Float": 0.25, "A_Float": 1, "B_Float": 2, "A_Vector": a, "B_Vector": b, "A_Color": A, "B_Color": B}
    for socket in new.inputs:
        socket.default_value = sockets.get(socket.identifier, socket.default_value)
    paint.node_tree.links.new(next(s for s in new.outputs if not s.is_unavailable), color_of(paint.node_tree))
    assert color(paint) == expected


def test_all_exported_modes_exist(tree: bpy.types.NodeTree):
    modes = {
        "ShaderNodeMath": ("operation", "math"),
        "ShaderNodeVectorMath": ("operation", "vector_math"),
        "ShaderNodeMix": ("blend_type", "mix"),
    }
    for kind, (name, op) in modes.items():
        blenders = {item.identifier for item in getattr(bpy.types, kind).bl_rna.properties[name].enum_items}
        assert all(fault(op, mode, len(OPS[op].inputs), len(OPS[op].options)) == "" for mode in blenders)


def test_types_are_converted(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    strength = surface(tree)
    emission = node(tree, "ShaderNodeEmission", into=strength)
    rgb = node(tree, "ShaderNodeRGB", into=emission.inputs["Strength"])
    rgb.outputs[0].default_value = A
    shader, _ = read(paint)
    assert tree_of(shader, only(shader).inputs["strength"]) == ("luminance", (a,))
    node(tree, "ShaderNodeNewGeometry", into=emission.inputs["Strength"], output="Position")
    shader, _ = read(paint)
    assert tree_of(shader, only(shader).inputs["strength"]) == ("average", (("position",),))
    node(tree, "ShaderNodeValue", into=emission.inputs["Color"]).outputs[0].default_value = 0.5
    assert only(read(paint)[0]).inputs["color"] == 0.5


# --- values from outside the tree ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "output", "properties", "expected", "requested"),
    [
        ("ShaderNodeTexCoord", "UV", {}, ("attribute", (0,)), [("UV", "")]),
        ("ShaderNodeTexCoord", "Generated", {}, ("attribute", (0,)), [("GENERATED", "")]),
        ("ShaderNodeTexCoord", "Object", {}, ("attribute", (0,)), [("OBJECT", "")]),
        ("ShaderNodeUVMap", 0, {"uv_map": "Second"}, ("attribute", (0,)), [("UV", "Second")]),
        ("ShaderNodeAttribute", "Color", {"attribute_name": "Rust"}, ("attribute", (0,)), [("ATTRIBUTE", "Rust")]),
        ("ShaderNodeAttribute", "Factor", {"attribute_name": "Rust"}, ("average", (("attribute", (0,)),)), [("ATTRIBUTE", "Rust")]),
        ("ShaderNodeAttribute", "Alpha", {"attribute_name": "Rust"}, ("attribute", (0,)), [("ATTRIBUTE_ALPHA", "Rust")]),
        ("ShaderNodeAttribute", "Color", {}, 0.0, []),
        ("ShaderNodeVertexColor", "Color", {}, ("attribute", (0,)), [("ATTRIBUTE", "")]),
        ("ShaderNodeTangent", 0, {"axis": "X"}, ("tangent", (0, 0, 1, 2)), [("RADIAL", "X")]),
        ("ShaderNodeTangent", 0, {"direction_type": "UV_MAP"}, ("tangent", (0, 0, 1, 2)), [("TANGENT", "")]),
        ("ShaderNodeNewGeometry", "Tangent", {}, ("tangent", (0, 0, 1, 2)), [("RADIAL", "Z")]),
        ("ShaderNodeNewGeometry", "True Normal", {}, ("true_normal",), []),
        ("ShaderNodeNewGeometry", "Backfacing", {}, ("backfacing",), []),
        ("ShaderNodeLightPath", "Ray Length", {}, ("light_path", "RAY_LENGTH"), []),
        ("ShaderNodeLightPath", "Is Volume Scatter Ray", {}, 0.0, []),
        ("ShaderNodeFresnel", 0, {}, ("fresnel", (1.5,)), []),
    ],
)
def test_inputs(paint: bpy.types.Material, kind: str, output: int | str, properties: dict, expected: Any, requested: list):
    new = probe(paint.node_tree, kind, output)
    for name, value in properties.items():
        setattr(new, name, value)
    resources = Resources()
    assert color(paint, resources) == expected
    assert resources.corner_attributes == requested


def test_coordinates_of_another_object(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    other = probe(tree, "ShaderNodeTexCoord", "Object").object = bpy.data.objects.new("Other", None)
    resources = Resources()
    assert color(paint, resources) == ("attribute", (0,))
    assert resources.corner_attributes == [("OBJECT", other.name)]


def test_object_info(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    resources, new = Resources(), probe(tree, "ShaderNodeObjectInfo", "Random")
    assert color(paint, resources) == ("object_attribute", (0,))
    assert resources.object_attributes == ["random"]
    paint.pass_index = 7
    tree.links.new(new.outputs["Material Index"], color_of(tree))
    assert color(paint) == 7.0


def test_a_normal_that_is_given(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    probe(tree, "ShaderNodeLayerWeight", "Fresnel", Normal=node(tree, "ShaderNodeNewGeometry").outputs["True Normal"])
    assert color(paint) == ("layer_weight", "FRESNEL", (0.5, ("true_normal",)))


@pytest.mark.parametrize(
    ("kind", "output"),
    [
        ("ShaderNodeTexCoord", "Camera"),
        ("ShaderNodeTexCoord", "Window"),
        ("ShaderNodeNewGeometry", "Pointiness"),
        ("ShaderNodeNewGeometry", "Random Per Island"),
        ("ShaderNodeLightPath", "Transparent Depth"),
    ],
)
def test_unsupported_outputs(paint: bpy.types.Material, kind: str, output: str):
    new = probe(paint.node_tree, kind, output)
    shader, notes = read(paint)
    detail = "not supported: the unlinked values of the sockets that it leads to stand in"
    assert notes == [f"node '{new.name}', socket '{output}': {detail}"]
    assert only(shader).inputs["color"] == (1.0, 1.0, 1.0)


@pytest.mark.parametrize("kind", ["ShaderNodeTexVoronoi", "ShaderNodeWavelength", "ShaderNodeBevel", "ShaderNodeCameraData"])
def test_unsupported_nodes_are_listed_once(paint: bpy.types.Material, tree: bpy.types.NodeTree, kind: str):
    new = probe(tree, kind)
    emission = surface(tree).links[0].from_node
    tree.links.new(new.outputs[0], emission.inputs["Strength"])
    detail = f"{new.bl_label} is not supported: the unlinked values of the sockets that it leads to stand in"
    shader, notes = read(paint)
    assert notes == [f"node '{new.name}': {detail}"]
    assert only(shader).inputs == {"color": (1.0, 1.0, 1.0), "strength": 1.0}


# --- normals ---------------------------------------------------------------------------------------------------------

SIGNED = ("vector_math", "MULTIPLY_ADD", (a, (2.0, 2.0, 2.0), (-1.0, -1.0, -1.0), 0.0))


@pytest.mark.parametrize(
    ("space", "expected"),
    [
        ("TANGENT", ("bend", (("transform", (0, 1, 2), (("tangent_space", (0, 1, 2), (SIGNED, 0.5)),)), 1.0))),
        ("OBJECT", ("bend", (("transform", (0, 1, 2), (SIGNED,)), 0.5))),
        ("WORLD", ("bend", (SIGNED, 0.5))),
        ("BLENDER_WORLD", ("bend", (("vector_math", "MULTIPLY_ADD", (a, (2.0, -2.0, -2.0), (-1.0, 1.0, 1.0), 0.0)), 0.5))),
    ],
)
def test_normal_maps(paint: bpy.types.Material, tree: bpy.types.NodeTree, space: str, expected: tuple):
    new = probe(tree, "ShaderNodeNormalMap", Color=A, Strength=0.5)
    new.space, new.uv_map = space, "Second"
    resources = Resources()
    assert color(paint, resources) == expected
    kinds = [("TANGENT", "Second"), ("TANGENT_SIGN", "Second"), ("OBJECT_NORMAL", "")]
    assert resources.corner_attributes == (kinds if space == "TANGENT" else [])
    assert resources.object_attributes == ([] if space.endswith("WORLD") else ["x_axis", "y_axis", "z_axis"])


def test_bump(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    bump = probe(tree, "ShaderNodeBump", Strength=0.5, Distance=2)
    assert color(paint) == ("normal",)  # there is no height
    bump.invert = True
    node(tree, "ShaderNodeTexGradient", into=bump.inputs["Height"])
    node(tree, "ShaderNodeNormalMap", into=bump.inputs["Normal"], Color=A).space = "WORLD"
    height = ("gradient", "LINEAR", (("attribute", (0,)),))
    assert color(paint) == ("bump", (1,), (("luminance", (height,)), 0.5, 2.0, ("bend", (SIGNED, 1.0))))


def test_the_normal_node(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    new = probe(tree, "ShaderNodeNormal", "Dot", Normal=b)
    new.outputs["Normal"].default_value = a
    first, second = (("vector_math", "NORMALIZE", (v, 0.0, 0.0, 0.0)) for v in (a, b))
    assert color(paint) == ("vector_math", "DOT_PRODUCT", (first, second, 0.0, 0.0))
