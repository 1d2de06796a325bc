"""Nodes that make normals."""

from collections.abc import Callable

from blender_rl_guiding.scene.description import Value

from ..network import At, unlinked

_AXES = ("x_axis", "y_axis", "z_axis")


def _normal_map(at: At, _output: str) -> Value:
    node, resources = at.node, at.network.resources
    color, strength = _right_handed(at, at.value("Color")), at.value("Strength")
    if node.space == "TANGENT":
        options = (resources.corner_attribute("TANGENT", node.uv_map), resources.corner_attribute("TANGENT_SIGN", node.uv_map))
        return at.add("normal_map", color, strength, options=options)
    if node.space.endswith("WORLD"):
        return at.add("normal_map_world", color, strength)
    return at.add("normal_map_object", color, strength, options=tuple(resources.object_attribute(axis) for axis in _AXES))


def _right_handed(at: At, color: Value) -> Value:
    """The colour with those axes turned round that the map has the other way."""
    if at.node.space.startswith("BLENDER_"):
        return at.add("vector_math", color, (1.0, -1.0, -1.0), (0.0, 1.0, 1.0), 0.0, mode="MULTIPLY_ADD")
    if getattr(at.node, "convention", "OPENGL") == "DIRECTX" and at.node.space == "TANGENT":
        return at.add("vector_math", color, (1.0, -1.0, 1.0), (0.0, 1.0, 0.0), 0.0, mode="MULTIPLY_ADD")
    return color


def _bump(at: At, _output: str) -> Value:
    normal = at.normal()
    if not at.linked("Height"):
        return normal[0] if normal else at.add("normal")
    values = (at.value("Height"), at.value("Strength"), at.value("Distance"))
    return at.add("bump", *values, *normal, options=(int(at.node.invert),))


def _normal(at: At, output: str) -> Value:
    direction = at.add("vector_math", unlinked(at.node.outputs["Normal"]), 0.0, 0.0, 0.0, mode="NORMALIZE")
    if output == "Normal":
        return direction
    other = at.add("vector_math", at.value("Normal"), 0.0, 0.0, 0.0, mode="NORMALIZE")
    return at.add("vector_math", direction, other, 0.0, 0.0, mode="DOT_PRODUCT")


READERS: dict[str, Callable[[At, str], Value | None]] = {
    "ShaderNodeNormalMap": _normal_map,
    "ShaderNodeBump": _bump,
    "ShaderNodeNormal": _normal,
}
