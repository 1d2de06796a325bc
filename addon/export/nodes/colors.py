"""Nodes that compute with colours."""

from blender_rl_guiding.scene.description import Value

from ..network import At, Reader, step


def _mix(at: At, _output: str) -> Value | None:
    node, kind = at.node, at.node.data_type
    if kind == "ROTATION":
        at.note("rotations cannot be mixed: the unlinked values of the sockets that it leads to stand in")
        return None
    suffix = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}[kind]
    by_components = kind == "VECTOR" and node.factor_mode == "NON_UNIFORM"
    values = [at.value(name) for name in ("Factor_Vector" if by_components else "Factor_Float", f"A_{suffix}", f"B_{suffix}")]
    mode, clamped = (node.blend_type, int(node.clamp_result)) if kind == "RGBA" else ("MIX", 0)
    return at.add("mix", *values, mode=mode, options=(int(node.clamp_factor), clamped))


def _mix_rgb(at: At, _output: str) -> Value:
    values = [at.value(name) for name in ("Fac", "Color1", "Color2")]
    return at.add("mix", *values, mode=at.node.blend_type, options=(1, int(at.node.use_clamp)))


def _separate(at: At, output: str) -> Value:
    separated = at.add("separate", at.value("Color"), mode=at.node.mode)
    return at.add("component", separated, options=(("Red", "Green", "Blue").index(output),))


def _combine(at: At, _output: str) -> Value:
    return at.add("combine", at.value("Red"), at.value("Green"), at.value("Blue"), mode=at.node.mode)


READERS: dict[str, Reader] = {
    "ShaderNodeMix": _mix,
    "ShaderNodeMixRGB": _mix_rgb,
    "ShaderNodeInvert": step("invert", "Fac", "Color"),
    "ShaderNodeGamma": step("gamma", "Color", "Gamma"),
    "ShaderNodeBrightContrast": step("bright_contrast", "Color", "Bright", "Contrast"),
    "ShaderNodeHueSaturation": step("hsv", "Hue", "Saturation", "Value", "Fac", "Color"),
    "ShaderNodeSeparateColor": _separate,
    "ShaderNodeCombineColor": _combine,
    "ShaderNodeRGBToBW": step("luminance", "Color"),
}
