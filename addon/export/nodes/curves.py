"""Colour ramps and curves: tables, as in Cycles."""

import bpy
import numpy as np

from blender_rl_guiding.scene.data import TABLE_SIZE
from blender_rl_guiding.scene.description import Value

from ..network import At, Reader


def _ramp(at: At, output: str) -> Value:
    ramp = at.node.color_ramp
    table = at.network.resources.table(np.array([ramp.evaluate(t) for t in np.linspace(0, 1, TABLE_SIZE)], np.float32))
    options = (table, int(ramp.interpolation != "CONSTANT"))
    return at.add("ramp" if output == "Color" else "ramp_alpha", at.value("Fac"), options=options)


def _rgb_curves(at: At, _output: str) -> Value:
    mapping = at.node.mapping
    mapping.update()
    *colors, combined = mapping.curves
    low, high = _ends(mapping.curves)
    brightness = [mapping.evaluate(combined, t) for t in np.linspace(low, high, TABLE_SIZE)]
    table = at.network.resources.table(_columns([[mapping.evaluate(curve, t) for t in brightness] for curve in colors]))
    return _looked_up(at, "curves", at.value("Fac"), at.value("Color"), table, (low, high))


def _vector_curves(at: At, _output: str) -> Value:
    return _looked_up(at, "curves", at.value("Fac"), at.value("Vector"), *_table(at))


def _float_curve(at: At, _output: str) -> Value:
    return _looked_up(at, "float_curve", at.value("Factor"), at.value("Value"), *_table(at))


def _table(at: At) -> tuple[int, tuple[float, float]]:
    """The number of the table of a node's curves, and the two ends of its range."""
    mapping = at.node.mapping
    mapping.update()
    low, high = _ends(mapping.curves)
    columns = [[mapping.evaluate(curve, t) for t in np.linspace(low, high, TABLE_SIZE)] for curve in mapping.curves]
    return at.network.resources.table(_columns(columns)), (low, high)


def _ends(curves: list[bpy.types.CurveMap]) -> tuple[float, float]:
    """From the first point of any of the curves to the last, as in Cycles."""
    return min(curve.points[0].location.x for curve in curves), max(curve.points[-1].location.x for curve in curves)


def _columns(columns: list[list[float]]) -> np.ndarray:
    """(256, 4) with the given columns, the last of them repeated."""
    return np.array((columns + [columns[-1]] * 3)[:4], np.float32).T


def _looked_up(at: At, op: str, factor: Value, value: Value, table: int, ends: tuple[float, float]) -> Value:
    """The look-up of values in a table over 0..1: values between the ends are first mapped to 0..1. The result is blended afterwards."""
    low, high = ends
    options = (table, int(at.node.mapping.extend == "EXTRAPOLATED"))
    if ends == (0.0, 1.0):
        return at.add(op, factor, value, options=options)
    place = at.add("map_range", value, low, high, 0.0, 1.0, mode="LINEAR", options=(0,))
    return at.add("mix", factor, value, at.add(op, 1.0, place, options=options), mode="MIX", options=(0, 0))


READERS: dict[str, Reader] = {
    "ShaderNodeValToRGB": _ramp,
    "ShaderNodeRGBCurve": _rgb_curves,
    "ShaderNodeVectorCurve": _vector_curves,
    "ShaderNodeFloatCurve": _float_curve,
}
