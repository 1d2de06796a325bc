"""Input nodes: constants, coordinates, attributes, the object and the ray."""

from blender_rl_guiding.scene.description import Value

from ..network import At, Reader, find, unlinked

_OBJECT_INFO = {"Location": "location", "Color": "color", "Alpha": "alpha", "Object Index": "object_index", "Random": "random"}
_RAYS = ("Is Camera Ray", "Is Shadow Ray", "Is Diffuse Ray", "Is Glossy Ray", "Is Transmission Ray", "Ray Length", "Ray Depth")
_GEOMETRY = {
    "Position": "position",
    "Normal": "normal",
    "True Normal": "true_normal",
    "Incoming": "incoming",
    "Backfacing": "backfacing",
}


def _constant(at: At, output: str) -> Value:
    """The value that a node keeps in its output."""
    return unlinked(find(at.node.outputs, output))


def _unsupported(at: At, output: str) -> None:
    at.note("not supported: the unlinked values of the sockets that it leads to stand in", output)


def uv(at: At, name: str = "") -> Value:
    """Coordinates of a UV map; 0 in the world, because it has no UV map."""
    return (0.0, 0.0, 0.0) if at.network.world else at.attribute("UV", name)


def generated(at: At) -> Value:
    """Texture space coordinates; in the world the direction."""
    return at.add("position") if at.network.world else at.attribute("GENERATED")


def _texture_coordinate(at: At, output: str) -> Value | None:
    if at.node.from_instancer and output in ("Generated", "UV"):
        at.note("of the instancer: those of the instance stand in", output)
    if output == "UV":
        return uv(at)
    if output == "Generated":
        return generated(at)
    if output == "Normal":
        return at.add("normal") if at.network.world else _object_normal(at)
    if output == "Object" and not at.network.world:
        return at.attribute("OBJECT", at.node.object.name if at.node.object else "")
    if output == "Object" and at.node.object is None:
        return at.add("position")
    if output == "Reflection" and not at.network.world:
        reflected = at.add("vector_math", at.add("incoming"), at.add("normal"), 0.0, 0.0, mode="REFLECT")
        return at.add("vector_math", reflected, 0.0, 0.0, -1.0, mode="SCALE")
    return _unsupported(at, output)


def _object_normal(at: At) -> Value:
    """The normal in the object's space, turned towards the ray."""
    side = at.add("math", at.add("backfacing"), -2.0, 1.0, mode="MULTIPLY_ADD", options=(0,))
    facing = at.add("vector_math", at.attribute("OBJECT_NORMAL"), 0.0, 0.0, side, mode="SCALE")
    return at.add("vector_math", facing, 0.0, 0.0, 0.0, mode="NORMALIZE")


def _uv_map(at: At, output: str) -> Value:
    if at.node.from_instancer:
        at.note("of the instancer: those of the instance stand in", output)
    return uv(at, at.node.uv_map)


def _attribute(at: At, output: str) -> Value | None:
    node = at.node
    if (at.network.world and node.attribute_type == "VIEW_LAYER") or (at.network.lamp and node.attribute_type != "GEOMETRY"):
        at.note(f"attributes of type {node.attribute_type}: the unlinked values of the sockets that it leads to stand in")
        return None
    if not node.attribute_name or at.network.world:
        return 0.0
    if node.attribute_type != "GEOMETRY":
        key = node.attribute_type, node.attribute_name, "Alpha" if output == "Alpha" else "Color"
        value = at.add("object_attribute", options=(at.network.resources.object_attribute(key),))
        return at.add("average", value) if output == "Fac" else value
    if output == "Alpha":
        return at.attribute("ATTRIBUTE_ALPHA", node.attribute_name)
    value = at.attribute("ATTRIBUTE", node.attribute_name)
    return at.add("average", value) if output == "Fac" else value


def _color_attribute(at: At, output: str) -> Value:
    if at.network.world:
        return 0.0
    return at.attribute("ATTRIBUTE_ALPHA" if output == "Alpha" else "ATTRIBUTE", at.node.layer_name)


def tangent(at: At, axis: str = "Z") -> Value:
    """Cycles' default tangent: around an axis of the object."""
    return _perpendicular(at, "RADIAL", axis)


def _perpendicular(at: At, kind: str, name: str) -> Value:
    """A tangent from an attribute that is a direction in the space of the object."""
    resources = at.network.resources
    return at.add("tangent", options=(resources.corner_attribute(kind, name), *resources.normal_axes()))


def _tangent(at: At, output: str) -> Value | None:
    if at.network.lamp:
        return _unsupported(at, output)
    if at.node.direction_type == "RADIAL":
        return tangent(at, at.node.axis)
    return _perpendicular(at, "TANGENT", at.node.uv_map)


def _geometry(at: At, output: str) -> Value | None:
    if output == "Tangent" and not at.network.world:
        return _tangent(at, output) if at.network.lamp else tangent(at)
    if output == "Parametric":
        return (1.0, 0.0, 0.0) if at.network.world else at.attribute("PARAMETRIC")
    return at.add(_GEOMETRY[output]) if output in _GEOMETRY else _unsupported(at, output)


def _object_info(at: At, output: str) -> Value | None:
    if output == "Material Index":
        return float(at.network.pass_index)
    if output in _OBJECT_INFO and not at.network.world:
        return at.network.object_attribute(_OBJECT_INFO[output])
    return _unsupported(at, output)


def _light_path(at: At, output: str) -> Value | None:
    if output == "Is Volume Scatter Ray":
        return 0.0  # there are no volumes
    return at.network.light_path(output.upper().replace(" ", "_")) if output in _RAYS else _unsupported(at, output)


def _light_falloff(at: At, output: str) -> Value:
    """strength * distance^k, k = 0 for Quadratic, 1 for Linear, 2 for Constant; times d^2 / (d^2 + smooth)."""
    strength, smooth = at.value("Strength"), at.value("Smooth")
    if at.network.distant:
        return strength
    distance = at.network.light_path("RAY_LENGTH")
    squared = _math(at, "MULTIPLY", distance, distance)
    if output != "Quadratic":
        strength = _math(at, "MULTIPLY", strength, distance if output == "Linear" else squared)
    if isinstance(smooth, float) and smooth <= 0:
        return strength
    smoothed = _math(at, "DIVIDE", squared, _math(at, "ADD", squared, _math(at, "MAXIMUM", smooth, 0.0)))
    return _math(at, "MULTIPLY", strength, smoothed)


def _math(at: At, mode: str, a: Value, b: Value) -> Value:
    return at.add("math", a, b, 0.0, mode=mode, options=(0,))


def _fresnel(at: At, _output: str) -> Value:
    return at.add("fresnel", at.value("IOR"), *at.normal())


def _layer_weight(at: At, output: str) -> Value:
    return at.add("layer_weight", at.value("Blend"), *at.normal(), mode=output.upper())


READERS: dict[str, Reader] = {
    "ShaderNodeRGB": _constant,
    "ShaderNodeValue": _constant,
    "ShaderNodeTexCoord": _texture_coordinate,
    "ShaderNodeUVMap": _uv_map,
    "ShaderNodeAttribute": _attribute,
    "ShaderNodeVertexColor": _color_attribute,
    "ShaderNodeTangent": _tangent,
    "ShaderNodeNewGeometry": _geometry,
    "ShaderNodeObjectInfo": _object_info,
    "ShaderNodeLightPath": _light_path,
    "ShaderNodeLightFalloff": _light_falloff,
    "ShaderNodeFresnel": _fresnel,
    "ShaderNodeLayerWeight": _layer_weight,
}
