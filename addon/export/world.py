"""The surroundings as one constant radiance."""

import bpy

from blender_rl_guiding.scene.data import Loss

from .materials import Color, has_link, linked_shader, radiance

BLACK = (0.0, 0.0, 0.0)


def read_world(world: bpy.types.World | None) -> tuple[Color, list[Loss]]:
    """Linear RGB. As in Cycles no world is black, and a world without nodes is its colour."""
    if world is None:
        return BLACK, []
    if world.node_tree is None or (bpy.app.version < (5, 0) and not world.use_nodes):
        return tuple(world.color), []
    notes: list[tuple[str, str]] = []
    color = _surface(world.node_tree.get_output_node("CYCLES"), notes)
    if any(color):
        notes += _visibility(world)
    return color, [Loss(world.name, where, detail) for where, detail in notes]


def _surface(output: bpy.types.Node | None, notes: list[tuple[str, str]]) -> Color:
    if output is None:
        return BLACK
    if has_link(output.inputs["Volume"]):
        notes.append(("socket 'Volume'", "the volume is left out"))
    shader = linked_shader(output.inputs["Surface"])
    if shader is None:
        return BLACK
    if shader.bl_idname != "ShaderNodeBackground":
        notes.append((f"node '{shader.name}'", f"{shader.bl_label} is not supported: black stands in"))
        return BLACK
    return radiance(shader, "Color", "Strength", lambda socket, detail: notes.append((f"node '{shader.name}', socket '{socket}'", detail)))


def _visibility(world: bpy.types.World) -> list[tuple[str, str]]:
    """Cycles' ray visibility, for the kinds of rays that exist here."""
    rays = getattr(world, "cycles_visibility", None)
    hidden = [kind for kind in ("camera", "diffuse") if rays and not getattr(rays, kind)]
    return [("ray visibility", f"visible to {kind} rays, although switched off") for kind in hidden]
