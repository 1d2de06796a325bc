"""Ramps, curves and the Blackbody node become tables with Blender's values, if their input varies."""

import bpy
import numpy as np
import pytest

from addon.export.resources import Resources
from blender_rl_guiding.scene.data import TABLE_SIZE
from tests.addon.trees import color, node, probe

A = (0.25, 0.5, 0.75, 1)
a = A[:3]


@pytest.fixture
def tree(paint: bpy.types.Material) -> bpy.types.NodeTree:
    return paint.node_tree


@pytest.mark.parametrize(("output", "op"), [("Color", "ramp"), ("Alpha", "ramp_alpha")])
def test_a_ramp_is_a_table(paint: bpy.types.Material, tree: bpy.types.NodeTree, output: str, op: str):
    ramp = probe(tree, "ShaderNodeValToRGB", output).color_ramp
    ramp.elements[0].color, ramp.elements[1].color = (0, 0, 1, 0), (1, 0.5, 0, 1)
    resources = Resources()
    assert color(paint, resources) == (op, (0, 1), (0.5,))
    t = np.linspace(0, 1, TABLE_SIZE)
    assert resources.tables == pytest.approx(np.stack([t, t / 2, 1 - t, t], axis=1)[None], abs=1e-6)
    ramp.interpolation = "CONSTANT"
    assert color(paint) == (op, (0, 0), (0.5,))


def test_curves_are_tables_of_the_combined_curve_first(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    mapping = probe(tree, "ShaderNodeRGBCurve", Color=A).mapping
    mapping.curves[3].points[1].location.y = 0.5  # the combined curve halves values
    mapping.curves[1].points[0].location.y = 1  # the green curve is 1
    resources = Resources()
    assert color(paint, resources) == ("curves", (0, 1), (1.0, a))
    t = np.linspace(0, 1, TABLE_SIZE) / 2
    assert resources.tables[0, :, :3] == pytest.approx(np.stack([t, np.ones(TABLE_SIZE), t], axis=1), abs=1e-3)


def test_curves_over_another_range_are_mapped_there(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    curve = probe(tree, "ShaderNodeVectorCurve", Vector=a)
    curve.mapping.extend = "HORIZONTAL"
    place = ("map_range", "LINEAR", (0,), (a, -1.0, 1.0, 0.0, 1.0))
    resources = Resources()
    assert color(paint, resources) == ("mix", "MIX", (0, 0), (1.0, a, ("curves", (0, 0), (1.0, place))))
    assert resources.tables[0, :, 2] == pytest.approx(np.linspace(-1, 1, TABLE_SIZE), abs=1e-3)


def test_a_float_curve(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    probe(tree, "ShaderNodeFloatCurve", Value=0.25, Factor=0.5)
    resources = Resources()
    assert color(paint, resources) == ("float_curve", (0, 1), (0.5, 0.25))
    assert resources.tables[0, :, 0] == pytest.approx(np.linspace(0, 1, TABLE_SIZE), abs=1e-3)


HOT = {1000: (4.6021, 0.0390, 0), 3000: (1.7711, 0.8443, 0.2722), 6500: (1.0427, 0.9840, 1.0350)}  # colours that Cycles 5.2 renders


@pytest.mark.parametrize("temperature", HOT)
def test_a_blackbody_is_a_colour(paint: bpy.types.Material, tree: bpy.types.NodeTree, temperature: float):
    probe(tree, "ShaderNodeBlackbody", Temperature=temperature)
    assert color(paint) == pytest.approx(HOT[temperature], abs=1e-4)


def test_a_blackbody_whose_temperature_varies_is_a_table_of_colours(paint: bpy.types.Material, tree: bpy.types.NodeTree):
    depth = node(tree, "ShaderNodeLightPath").outputs["Ray Depth"]
    probe(tree, "ShaderNodeBlackbody", Temperature=depth)
    resources, low, high = Resources(), np.log(800), np.log(12000)
    logarithm = ("math", "LOGARITHM", (0,), (("light_path", "RAY_DEPTH"), np.e, 0.0))
    assert color(paint, resources) == ("ramp", (0, 1), (("map_range", "LINEAR", (0,), (logarithm, low, high, 0.0, 1.0)),))
    for temperature, expected in HOT.items():
        found = [np.interp(np.log(temperature), np.linspace(low, high, TABLE_SIZE), column) for column in resources.tables[0, :, :3].T]
        assert found == pytest.approx(expected, abs=1e-4)
