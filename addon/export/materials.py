"""Materials as a diffuse colour and an emission, with a note of every input that cannot be told so."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import bpy

from blender_rl_guiding.scene.data import Material

Color = tuple[float, float, float]
Note = Callable[[str, str], None]  # (socket, what is lost)

BLACK = (0.0, 0.0, 0.0)
GREY = (0.8, 0.8, 0.8)  # Cycles' surface where an object has no material

# Inputs of the Principled BSDF that turn something on which a diffuse surface lacks, with the value that leaves it off.
# Those that only shape such a thing (Roughness, IOR, Coat Tint, ...) need no line of their own.
_OFF = {
    "Metallic": 0.0,
    "Alpha": 1.0,
    "Diffuse Roughness": 0.0,
    "Subsurface Weight": 0.0,
    "Specular IOR Level": 0.0,
    "Transmission Weight": 0.0,
    "Coat Weight": 0.0,
    "Sheen Weight": 0.0,
}


class Surface(NamedTuple):
    """A material and the places in it, (where, what is lost), that it does not do justice to."""

    material: Material
    notes: tuple[tuple[str, str], ...]


def read_material(material: bpy.types.Material | None) -> Surface:
    """As in Cycles, no material is grey, a material without nodes is its viewport colour, and one without a surface black."""
    if material is None:
        return Surface(Material("", GREY, BLACK), ())
    if material.node_tree is None or (bpy.app.version < (5, 0) and not material.use_nodes):
        return Surface(Material(material.name, _albedo(material.diffuse_color, "", lambda *_: None), BLACK), ())
    notes: list[tuple[str, str]] = []
    output = material.node_tree.get_output_node("CYCLES")
    base_color, emission = _read_output(output, notes) if output else (BLACK, BLACK)
    return Surface(
        Material(material.name, base_color, emission), tuple((f"material '{material.name}', {where}", detail) for where, detail in notes)
    )


def _read_output(output: bpy.types.Node, notes: list[tuple[str, str]]) -> tuple[Color, Color]:
    for socket, loss in (("Volume", "the volume is left out"), ("Displacement", "the surface is not displaced")):
        if has_link(output.inputs[socket]):
            notes.append((f"node '{output.name}', socket '{socket}'", loss))
    shader = linked_shader(output.inputs["Surface"])
    if shader is None:
        return BLACK, BLACK
    if shader.bl_idname not in _SHADERS:
        notes.append((f"node '{shader.name}'", f"{shader.bl_label} is not supported: a diffuse grey of 0.8 stands in"))
        return GREY, BLACK
    return _SHADERS[shader.bl_idname](shader, lambda socket, detail: notes.append((f"node '{shader.name}', socket '{socket}'", detail)))


def _diffuse(node: bpy.types.Node, note: Note) -> tuple[Color, Color]:
    if has_link(node.inputs["Roughness"]) or node.inputs["Roughness"].default_value:
        note("Roughness", "the surface is perfectly diffuse")
    _check_normal(node, note)
    return _albedo(_constant(node, "Color", note), "Color", note), BLACK


def _emission(node: bpy.types.Node, note: Note) -> tuple[Color, Color]:
    return BLACK, radiance(node, "Color", "Strength", note)


def _principled(node: bpy.types.Node, note: Note) -> tuple[Color, Color]:
    for socket in _active(node):
        state = "linked" if has_link(node.inputs[socket]) else f"{node.inputs[socket].default_value:g}"
        note(socket, f"{state}: a diffuse surface stands in, as if it were {_OFF[socket]:g}")
    _check_normal(node, note)
    color = _constant(node, "Base Color", note)
    return _clamped(color), radiance(node, "Emission Color", "Emission Strength", note)  # Cycles clamps this base colour itself


def _active(node: bpy.types.Node) -> Iterator[str]:
    """The inputs that turn something on; a pure metal has no dielectric reflection to turn on."""
    metal = not has_link(node.inputs["Metallic"]) and node.inputs["Metallic"].default_value >= 1.0
    no_reflection = metal or (not has_link(node.inputs["IOR"]) and node.inputs["IOR"].default_value == 1.0)
    for socket, off in _OFF.items():
        if socket == "Specular IOR Level" and no_reflection:
            continue
        if has_link(node.inputs[socket]) or node.inputs[socket].default_value != off:
            yield socket


_SHADERS: dict[str, Callable[[bpy.types.Node, Note], tuple[Color, Color]]] = {
    "ShaderNodeBsdfDiffuse": _diffuse,
    "ShaderNodeEmission": _emission,
    "ShaderNodeBsdfPrincipled": _principled,
}


def _check_normal(node: bpy.types.Node, note: Note) -> None:
    if has_link(node.inputs["Normal"]):
        note("Normal", "linked: the mesh's own normals stand in")


def radiance(node: bpy.types.Node, color: str, strength: str, note: Note) -> Color:
    """Colour times strength, not below zero; linked inputs are noted unless the other one is black anyway."""
    dark = [not has_link(node.inputs[color]) and not any(node.inputs[color].default_value[:3])]
    dark += [not has_link(node.inputs[strength]) and not node.inputs[strength].default_value]
    if any(dark):
        return BLACK
    scale = _constant(node, strength, note)
    r, g, b = (scale * c for c in _constant(node, color, note)[:3])
    if min(r, g, b) < 0:
        note(strength, f"negative light ({r:g}, {g:g}, {b:g}): zero stands in")
    return max(r, 0.0), max(g, 0.0), max(b, 0.0)


def _albedo(color: bpy.types.bpy_prop_array, socket: str, note: Note) -> Color:
    """Unlike the Principled BSDF, Cycles' Diffuse BSDF really reflects more than it receives if it is told to."""
    clamped = _clamped(color)
    if clamped != tuple(color[:3]):
        note(socket, f"{tuple(round(c, 3) for c in color[:3])}: clamped to 0..1")
    return clamped


def _clamped(color: bpy.types.bpy_prop_array) -> Color:
    r, g, b = (min(max(float(c), 0.0), 1.0) for c in color[:3])
    return r, g, b


def _constant(node: bpy.types.Node, name: str, note: Note):
    """The value of an input; for a linked one, which varies, the value that it would have without the link."""
    socket = node.inputs[name]
    if has_link(socket):
        value = socket.default_value
        shown = f"{value:g}" if isinstance(value, float) else f"({', '.join(f'{c:g}' for c in value[:3])})"
        note(name, f"linked: its unlinked value {shown} stands in")
    return socket.default_value


def has_link(socket: bpy.types.NodeSocket) -> bool:
    """Whether something arrives at an input."""
    return _source(socket) is not None


def linked_shader(socket: bpy.types.NodeSocket) -> bpy.types.Node | None:
    """The shader that arrives at an input; None if there is none, or it is muted, which makes it black."""
    node = _source(socket)
    return None if node is None or node.mute else node


def _source(socket: bpy.types.NodeSocket) -> bpy.types.Node | None:
    """The node at the other end of an input's link, past reroutes."""
    links = [link for link in socket.links if link.is_valid and not link.is_muted]
    if not links:
        return None
    node = links[0].from_node
    return _source(node.inputs[0]) if node.bl_idname == "NodeReroute" else node
