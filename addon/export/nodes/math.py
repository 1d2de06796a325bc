"""Nodes that compute with numbers and vectors."""

from blender_rl_guiding.scene.description import Value

from ..network import At, Reader, find, step


def _used(at: At, identifier: str) -> Value:
    """The value of an input; 0 if the node's mode does not use it."""
    return 0.0 if find(at.node.inputs, identifier).is_unavailable else at.value(identifier)


def _math(at: At, _output: str) -> Value:
    numbers = [_used(at, identifier) for identifier in ("Value", "Value_001", "Value_002")]
    return at.add("math", *numbers, mode=at.node.operation, options=(int(at.node.use_clamp),))


def _vector_math(at: At, _output: str) -> Value:
    vectors = [_used(at, identifier) for identifier in ("Vector", "Vector_001", "Vector_002", "Scale")]
    return at.add("vector_math", *vectors, mode=at.node.operation)


def _clamp(at: At, _output: str) -> Value:
    return at.add("clamp", at.value("Value"), at.value("Min"), at.value("Max"), mode=at.node.clamp_type)


def _map_range(at: At, _output: str) -> Value:
    node = at.node
    if node.data_type == "FLOAT":
        value, names = at.value("Value"), ("From Min", "From Max", "To Min", "To Max", "Steps")
    else:
        value, names = at.value("Vector"), ("From_Min_FLOAT3", "From_Max_FLOAT3", "To_Min_FLOAT3", "To_Max_FLOAT3", "Steps_FLOAT3")
    from_min, from_max, to_min, to_max, steps = (_used(at, name) for name in names)
    if node.interpolation_type != "STEPPED":
        return at.add("map_range", value, from_min, from_max, to_min, to_max, mode=node.interpolation_type, options=(int(node.clamp),))
    factor = at.add("steps", at.add("map_range", value, from_min, from_max, 0.0, 1.0, mode="LINEAR", options=(0,)), steps)
    return at.add("map_range", factor, 0.0, 1.0, to_min, to_max, mode="LINEAR", options=(int(node.clamp),))


def _mapping(at: At, _output: str) -> Value:
    values = [_used(at, identifier) for identifier in ("Vector", "Location", "Rotation", "Scale")]
    return at.add("mapping", *values, mode=at.node.vector_type)


def _separate(at: At, output: str) -> Value:
    return at.add("component", at.value("Vector"), options=("XYZ".index(output),))


READERS: dict[str, Reader] = {
    "ShaderNodeMath": _math,
    "ShaderNodeVectorMath": _vector_math,
    "ShaderNodeClamp": _clamp,
    "ShaderNodeMapRange": _map_range,
    "ShaderNodeMapping": _mapping,
    "ShaderNodeSeparateXYZ": _separate,
    "ShaderNodeCombineXYZ": step("combine", "X", "Y", "Z", mode="RGB"),
}
