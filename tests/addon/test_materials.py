"""Shader nodes become Cycles' closures. Nodes without an equivalent are reported by name."""

from collections.abc import Callable
from typing import Any

import bpy
import pytest

from addon.export.resources import Resources
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import CLOSURES, Closure
from tests.addon.trees import node, only, put, read, surface, tree_of

Export = Callable[[], SceneData]
DIFFUSE, EMISSION, GLOSSY, PRINCIPLED = "ShaderNodeBsdfDiffuse", "ShaderNodeEmission", "ShaderNodeBsdfGlossy", "ShaderNodeBsdfPrincipled"


# --- one closure -----------------------------------------------------------------------------------------------------


def test_principled_has_all_inputs(paint: bpy.types.Material):
    sockets = {
        "Base Color": (0.25, 0.5, 0.75, 1), "Metallic": 0.5, "Roughness": 0.25, "IOR": 1.25, "Alpha": 0.75, "Diffuse Roughness": 0.125,
        "Specular IOR Level": 0.25, "Specular Tint": (1, 0.5, 0.25, 1), "Anisotropic": 0.5, "Anisotropic Rotation": 0.25,
        "Transmission Weight": 0.5, "Coat Weight": 0.5, "Coat Roughness": 0.25, "Coat IOR": 1.75, "Coat Tint": (0.5, 1, 1, 1),
        "Sheen Weight": 0.75, "Sheen Roughness": 0.125, "Sheen Tint": (0.25, 1, 0.5, 1), "Emission Color": (1, 0.5, 0, 1),
        "Emission Strength": 4,
    }  # fmt: skip
    bsdf = put(paint, PRINCIPLED)
    for name, value in sockets.items():
        bsdf.inputs[name].default_value = value
    for name in ("Normal", "Coat Normal", "Tangent"):
        node(paint.node_tree, "ShaderNodeNewGeometry", into=bsdf.inputs[name], output="Incoming")
    shader, notes = read(paint)
    closure = only(shader)
    assert notes == []
    assert closure.inputs.keys() == CLOSURES["principled"].keys()
    expected = [value[:3] if isinstance(value, tuple) else value for value in sockets.values()]
    others = {"normal", "coat_normal", "tangent", "multiscatter"}
    assert sorted(map(str, (v for k, v in closure.inputs.items() if k not in others))) == sorted(map(str, map(_floats, expected)))
    assert closure.inputs["transmission"] == 0.5
    assert closure.inputs["specular_ior_level"] == 0.25
    assert closure.inputs["anisotropic_rotation"] == 0.25
    assert tree_of(shader, closure.inputs["coat_normal"]) == ("incoming",)


def _floats(value: Any) -> Any:
    return tuple(float(v) for v in value) if isinstance(value, tuple) else float(value)


@pytest.mark.parametrize(
    ("kind", "inputs", "expected"),
    [
        (DIFFUSE, {"Roughness": 0.5}, Closure("diffuse", 1.0, {"color": (0.25, 0.5, 0.75), "roughness": 0.5})),
        ("ShaderNodeBsdfTranslucent", {}, Closure("translucent", 1.0, {"color": (0.25, 0.5, 0.75)})),
        ("ShaderNodeBsdfTransparent", {}, Closure("transparent", 1.0, {"color": (0.25, 0.5, 0.75)})),
        (EMISSION, {"Strength": 4}, Closure("emission", 1.0, {"color": (0.25, 0.5, 0.75), "strength": 4.0})),
        (
            GLOSSY,
            {"Roughness": 0.25},
            Closure("glossy", 1.0, {"color": (0.25, 0.5, 0.75), "roughness": 0.25, "anisotropy": 0.0, "multiscatter": 1.0}),
        ),
        (
            "ShaderNodeBsdfGlass",
            {"Roughness": 0.25, "IOR": 1.5},
            Closure("glass", 1.0, {"color": (0.25, 0.5, 0.75), "roughness": 0.25, "ior": 1.5, "multiscatter": 1.0}),
        ),
        (
            "ShaderNodeBsdfRefraction",
            {"IOR": 1.5},
            Closure("refraction", 1.0, {"color": (0.25, 0.5, 0.75), "roughness": 0.0, "ior": 1.5}),
        ),
        ("ShaderNodeBsdfSheen", {"Roughness": 0.25}, Closure("sheen", 1.0, {"color": (0.25, 0.5, 0.75), "roughness": 0.25})),
    ],
)
def test_closures(paint: bpy.types.Material, kind: str, inputs: dict, expected: Closure):
    put(paint, kind, Color=(0.25, 0.5, 0.75, 1), **inputs)
    shader, notes = read(paint)
    assert only(shader) == expected
    assert notes == []


def test_metallic(paint: bpy.types.Material):
    put(paint, "ShaderNodeBsdfMetallic", Base_Color=(0.25, 0.5, 0.75, 1), Edge_Tint=(1, 0.5, 1, 1), Roughness=0.25)
    inputs = {"base_color": (0.25, 0.5, 0.75), "edge_tint": (1.0, 0.5, 1.0), "roughness": 0.25, "anisotropy": 0.0, "multiscatter": 1.0}
    assert only(read(paint)[0]) == Closure("metallic", 1.0, inputs)


def test_plain_ggx_has_no_energy_compensation(paint: bpy.types.Material):
    put(paint, PRINCIPLED).distribution = "GGX"
    assert only(read(paint)[0]).inputs["multiscatter"] == 0.0


def test_anisotropy_without_a_tangent_goes_around_the_objects_z_axis(paint: bpy.types.Material):
    resources = Resources()
    put(paint, GLOSSY, Anisotropy=0.5)
    shader, _ = read(paint, resources)
    assert tree_of(shader, only(shader).inputs["tangent"]) == ("tangent", (0, 0, 1, 2))
    assert resources.corner_attributes == [("RADIAL", "Z")]


def test_emission_that_is_black_is_no_closure(paint: bpy.types.Material):
    put(paint, EMISSION, Color=(0, 0, 0, 1), Strength=node(paint.node_tree, "ShaderNodeTexVoronoi").outputs[0])
    shader, notes = read(paint)
    assert shader.closures == ()
    assert notes == []


def test_negative_light_is_reported(paint: bpy.types.Material):
    put(paint, EMISSION, Strength=-2)
    shader, notes = read(paint)
    assert notes == ["node 'Emission', socket 'Strength': negative light (-2): zero stands in"]
    assert shader.closures == ()


# --- what is reported ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "socket", "value", "detail"),
    [
        (PRINCIPLED, "Subsurface Weight", 0.5, "subsurface scattering is not supported: diffuse reflection stands in"),
        (PRINCIPLED, "Thin Film Thickness", 100, "the film is left out"),
        ("ShaderNodeBsdfGlass", "Thin Film Thickness", 100, "the film is left out"),
        ("ShaderNodeBsdfMetallic", "Thin Film Thickness", 100, "the film is left out"),
    ],
)
def test_what_has_no_counterpart(paint: bpy.types.Material, kind: str, socket: str, value: float, detail: str):
    bsdf = put(paint, kind)
    assert read(paint)[1] == []
    bsdf.inputs[socket].default_value = value
    assert read(paint)[1] == [f"node '{bsdf.name}', socket '{socket}': {detail}"]


@pytest.mark.skipif(bpy.app.version < (5, 2), reason="there is no thin wall yet")
def test_thin_walls_are_reported(paint: bpy.types.Material):
    put(paint, PRINCIPLED, Thin_Wall=True)
    assert read(paint)[1] == ["node 'Principled BSDF', socket 'Thin Wall': a solid stands in"]


@pytest.mark.parametrize(
    ("kind", "model", "detail"),
    [
        (GLOSSY, "BECKMANN", "distribution BECKMANN: GGX stands in"),
        (GLOSSY, "ASHIKHMIN_SHIRLEY", "distribution ASHIKHMIN_SHIRLEY: GGX stands in"),
        ("ShaderNodeBsdfSheen", "ASHIKHMIN", "distribution ASHIKHMIN: MICROFIBER stands in"),
    ],
)
def test_other_distributions(paint: bpy.types.Material, kind: str, model: str, detail: str):
    bsdf = put(paint, kind)
    bsdf.distribution = model
    assert read(paint)[1] == [f"node '{bsdf.name}': {detail}"]


def test_smooth_surfaces_have_no_distribution(paint: bpy.types.Material):
    put(paint, "ShaderNodeBsdfRefraction").distribution = "BECKMANN"
    assert read(paint)[1] == []


@pytest.mark.parametrize(
    ("kind", "detail"),
    [
        ("ShaderNodeBsdfToon", "a diffuse surface of its colour stands in"),
        ("ShaderNodeSubsurfaceScattering", "a diffuse surface of its colour stands in"),
        ("ShaderNodeHoldout", "a diffuse grey of 0.8 stands in"),
    ],
)
def test_other_shaders(paint: bpy.types.Material, kind: str, detail: str):
    bsdf = put(paint, kind)
    shader, notes = read(paint)
    assert only(shader).kind == "diffuse"
    assert notes == [f"node '{bsdf.name}': {bsdf.bl_label} is not supported: {detail}"]


def test_what_shapes_nothing_is_not_read(paint: bpy.types.Material):
    noise = node(paint.node_tree, "ShaderNodeTexVoronoi").outputs[0]
    names = ("Coat_Roughness", "Coat_IOR", "Coat_Tint", "Coat_Normal", "Sheen_Roughness", "Sheen_Tint", "Anisotropic_Rotation", "Tangent")
    put(paint, PRINCIPLED, Emission_Color=noise, **dict.fromkeys(names, noise))
    shader, notes = read(paint)
    assert notes == []
    assert shader.code == ()


def test_displacement_and_opaque_shadows(paint: bpy.types.Material):
    put(paint, PRINCIPLED, Alpha=0.5)
    node(paint.node_tree, "ShaderNodeDisplacement", into=surface(paint.node_tree).node.inputs["Displacement"])
    assert read(paint)[1] == ["node 'Material Output', socket 'Displacement': the surface is not displaced"]
    paint.use_transparent_shadow = False
    assert read(paint)[1][1:] == [": transparent shadows are off: its shadows are transparent"]


def test_a_loss_is_listed_once_for_each_object(run: Export, paint: bpy.types.Material):
    bpy.ops.mesh.primitive_plane_add()
    put(paint, "ShaderNodeBsdfToon")
    plane = bpy.context.object
    plane.data.materials.append(paint)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Other", plane.data))
    assert [(loss.object, loss.where) for loss in run().coverage] == [
        ("Plane", "material 'Paint', node 'Toon BSDF'"),
        ("Other", "material 'Paint', node 'Toon BSDF'"),
    ]
