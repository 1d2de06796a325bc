"""Nodes that make normals."""

import bpy

from blender_rl_guiding.scene.description import Color, Value

from ..network import At, Reader, unlinked


def _normal_map(at: At, _output: str) -> Value:
    node, resources, strength = at.node, at.network.resources, at.value("Strength")
    x, y, z = _signs(node)
    direction = at.add("vector_math", at.value("Color"), (2 * x, 2 * y, 2 * z), (-x, -y, -z), 0.0, mode="MULTIPLY_ADD")
    if node.space == "TANGENT":
        kinds = (("TANGENT", node.uv_map), ("TANGENT_SIGN", node.uv_map), ("OBJECT_NORMAL", ""))
        direction = at.add("tangent_space", direction, strength, options=tuple(resources.corner_attribute(*kind) for kind in kinds))
        strength = 1.0  # the strength is already applied to the slopes in tangent space
    if not node.space.endswith("WORLD"):
        direction = at.add("transform", direction, options=resources.normal_axes())
    return at.add("bend", direction, strength)


def _signs(node: bpy.types.ShaderNodeNormalMap) -> Color:
    """The sign of each axis: -1 if the map mirrors it."""
    if node.space.startswith("BLENDER_"):
        return 1.0, -1.0, -1.0
    mirrored = node.space == "TANGENT" and getattr(node, "convention", "OPENGL") == "DIRECTX"
    return 1.0, -1.0 if mirrored else 1.0, 1.0


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


READERS: dict[str, Reader] = {
    "ShaderNodeNormalMap": _normal_map,
    "ShaderNodeBump": _bump,
    "ShaderNodeNormal": _normal,
}
