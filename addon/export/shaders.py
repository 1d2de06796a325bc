"""Trees of shader nodes as closures: Mix and Add Shader become factors on their inputs."""

from collections.abc import Iterator

import bpy

from blender_rl_guiding.scene.description import CLOSURES, Closure, Value

from .network import At, Network, Path, find
from .nodes.inputs import tangent

_GREY = (0.8, 0.8, 0.8)
_DIRECTIONS = ("normal", "coat_normal", "tangent")
_KINDS = {
    "ShaderNodeBsdfDiffuse": "diffuse",
    "ShaderNodeBsdfTranslucent": "translucent",
    "ShaderNodeBsdfTransparent": "transparent",
    "ShaderNodeBsdfGlossy": "glossy",  # files of Blender 4.5 and older have this name or the next
    "ShaderNodeBsdfAnisotropic": "glossy",
    "ShaderNodeBsdfMetallic": "metallic",
    "ShaderNodeBsdfGlass": "glass",
    "ShaderNodeBsdfRefraction": "refraction",
    "ShaderNodeBsdfSheen": "sheen",
    "ShaderNodeBsdfPrincipled": "principled",
    "ShaderNodeEmission": "emission",
}
# An input that switches a part off at 0 -> the inputs that only this part uses.
_SHAPING = {
    "coat_weight": ("coat_roughness", "coat_ior", "coat_tint", "coat_normal"),
    "sheen_weight": ("sheen_roughness", "sheen_tint"),
    "emission_strength": ("emission_color",),
    "emission_color": ("emission_strength",),
    "anisotropic": ("anisotropic_rotation", "tangent"),
    "anisotropy": ("rotation", "tangent"),
}
# Sockets that are ignored: a value other than 0 is a loss.
_LOST = {
    "Subsurface Weight": "subsurface scattering is not supported: diffuse reflection stands in",
    "Thin Wall": "a solid stands in",
    "Thin Film Thickness": "the film is left out",
}


def closures_at(network: Network, socket: bpy.types.NodeSocket, path: Path = (), weight: Value = 1.0) -> Iterator[Closure]:
    """The closures of a shader input, times `weight`. Without a link there are none: the input is black."""
    at = network.shader(socket, path)
    if at is None or _is_zero(weight):
        return
    if at.node.bl_idname == "ShaderNodeMixShader":
        share = _clamped(at)
        yield from closures_at(network, find(at.node.inputs, "Shader"), at.path, _times(network, weight, _rest(network, share)))
        yield from closures_at(network, find(at.node.inputs, "Shader_001"), at.path, _times(network, weight, share))
    elif at.node.bl_idname == "ShaderNodeAddShader":
        for name in ("Shader", "Shader_001"):
            yield from closures_at(network, find(at.node.inputs, name), at.path, weight)
    else:
        yield from _closure(at, weight)


def _closure(at: At, weight: Value) -> Iterator[Closure]:
    kind = _KINDS.get(at.node.bl_idname)
    if at.network.world:
        yield from _of_world(at, weight)
    elif kind == "emission" or (at.network.lamp and at.node.bl_idname == "ShaderNodeBackground"):
        yield from emission(at, weight)
    elif at.network.lamp:
        if kind == "principled":  # other closures have no effect on a lamp
            yield Closure(kind, weight, _inputs(at, kind))
    elif kind is None:
        yield _stand_in(at, weight)
    elif kind == "principled" or not _is_black(at):
        for socket, detail in _LOST.items():
            if any(s.identifier == socket for s in at.node.inputs) and not _is_off(at, socket):
                at.note(detail, socket)
        yield Closure(kind, weight, {**_inputs(at, kind), **_distribution(at, kind)})


def _of_world(at: At, weight: Value) -> Iterator[Closure]:
    if at.node.bl_idname in ("ShaderNodeBackground", "ShaderNodeEmission"):
        yield from emission(at, weight)
    else:
        at.note(f"{at.node.bl_label} is not supported: black stands in")


def emission(at: At, weight: Value) -> Iterator[Closure]:
    """The closure of an Emission or Background node, unless it is black."""
    if _is_off(at, "Color") or _is_off(at, "Strength"):
        return
    color, strength = at.value("Color"), at.value("Strength")
    if isinstance(strength, float) and strength < 0:
        at.note(f"negative light ({strength:g}): zero stands in", "Strength")
    else:
        yield Closure("emission", weight, {"color": color, "strength": strength})


def _stand_in(at: At, weight: Value) -> Closure:
    if any(socket.identifier == "Color" for socket in at.node.inputs):
        at.note(f"{at.node.bl_label} is not supported: a diffuse surface of its colour stands in")
        return Closure("diffuse", weight, {"color": at.value("Color")})
    at.note(f"{at.node.bl_label} is not supported: a diffuse grey of 0.8 stands in")
    return Closure("diffuse", weight, {"color": _GREY})


def _inputs(at: At, kind: str) -> dict[str, Value]:
    """The inputs of a closure, except the inputs of lobes that are off."""
    names = [name for name in CLOSURES[kind] if name != "multiscatter"]
    idle = {shaping for name in names for shaping in _SHAPING.get(name, ()) if _is_off(at, _socket(name))}
    values = {name: at.direction(_socket(name)) if name in _DIRECTIONS else at.value(_socket(name)) for name in names if name not in idle}
    if "tangent" in values and values["tangent"] is None:
        values["tangent"] = tangent(at)
    return {name: value for name, value in values.items() if value is not None}


def _socket(name: str) -> str:
    """The identifier of the socket for an input of a closure."""
    words = name.replace("_", " ").title().replace("Ior", "IOR")
    return "Transmission Weight" if words == "Transmission" else words


def _distribution(at: At, kind: str) -> dict[str, Value]:
    """`multiscatter` of a closure, by the distribution that the node has."""
    model = getattr(at.node, "distribution", "")
    if kind == "sheen" and model != "MICROFIBER":
        at.note(f"distribution {model}: MICROFIBER stands in")
    elif kind != "sheen" and model in ("BECKMANN", "ASHIKHMIN_SHIRLEY") and not _is_off(at, "Roughness"):
        at.note(f"distribution {model}: GGX stands in")
    if getattr(at.node, "fresnel_type", "F82") != "F82":
        at.note("physical conductors are not supported: an F82 Tint of Base Color and Edge Tint stands in")
    return {"multiscatter": float(model == "MULTI_GGX")} if "multiscatter" in CLOSURES[kind] else {}


def _is_black(at: At) -> bool:
    return any(socket.identifier == "Color" for socket in at.node.inputs) and _is_off(at, "Color")


def _is_off(at: At, identifier: str) -> bool:
    """Whether an input is 0 or black, without a link."""
    return not at.linked(identifier) and _is_zero(at.value(identifier))


def _is_zero(value: Value) -> bool:
    return value in (0.0, (0.0, 0.0, 0.0))


def _clamped(at: At) -> Value:
    """The share of the second shader of a Mix Shader."""
    share = at.value("Fac")
    return min(max(share, 0.0), 1.0) if isinstance(share, float) else at.add("clamp", share, 0.0, 1.0, mode="MINMAX")


def _rest(network: Network, share: Value) -> Value:
    return 1.0 - share if isinstance(share, float) else network.add("math", 1.0, share, 0.0, mode="SUBTRACT", options=(0,))


def _times(network: Network, a: Value, b: Value) -> Value:
    """The product of two numbers. No step is needed if one of them is 1 or both are constants."""
    if isinstance(a, float) and isinstance(b, float):
        return a * b
    if 1.0 in (a, b):
        return b if a == 1.0 else a
    return network.add("math", a, b, 0.0, mode="MULTIPLY", options=(0,))
