"""Selects the object of a line of the coverage report, its material and its node."""

import re

import bpy

from blender_rl_guiding.scene.description import Loss

_MATERIAL, _NODE, _GROUP = (re.compile(rf"{kind} '(.*?)'(?:,|$)") for kind in ("material", "node", "group"))


def reveal(loss: Loss, context: bpy.types.Context) -> str:
    """Select the object, material and node of a loss. Returns a line about a part that cannot be selected, or an empty line."""
    scene, thing = context.scene, bpy.data.objects.get(loss.object)
    if scene.world and loss.object == scene.world.name and not (thing and _MATERIAL.search(loss.where)):
        _choose_node(scene.world.node_tree, loss.where)
        _turn_editors(context, "WORLD")
        return ""
    if thing is None:
        return "" if loss.object == scene.name else f"'{loss.object}' is not there any more"
    shown = _choose_material(thing, loss.where)
    if shown:
        _turn_editors(context, "OBJECT")
    return _select(thing, context.view_layer)


def _select(thing: bpy.types.Object, view_layer: bpy.types.ViewLayer) -> str:
    """Make the object the only selected one, and active."""
    if thing.name not in view_layer.objects:
        return f"'{thing.name}' is not in this view layer"
    for other in view_layer.objects.selected:
        other.select_set(False)
    view_layer.objects.active = thing
    if thing.hide_get() or thing.hide_select:
        return f"'{thing.name}' is hidden or cannot be selected: it is only made active"
    thing.select_set(True)
    return ""


def _choose_material(thing: bpy.types.Object, where: str) -> bool:
    """Make the material of a loss active, and its node, too. Returns whether the object has that material."""
    named = _MATERIAL.search(where)
    for index, slot in enumerate(thing.material_slots):
        if named and slot.material and slot.material.name == named[1]:
            thing.active_material_index = index
            _choose_node(slot.material.node_tree, where)
            return True
    return False


def _choose_node(tree: bpy.types.NodeTree | None, where: str) -> None:
    """Select only the node of a loss, or the group around this node, and make it active."""
    named = _GROUP.search(where) or _NODE.search(where)
    if not tree or not named:
        return
    for node in tree.nodes:
        group = getattr(node, "node_tree", None)
        node.select = named[1] in (node.name, group and group.name)
        if node.select:
            tree.nodes.active = node


def _turn_editors(context: bpy.types.Context, kind: str) -> None:
    """Turn the open shader editors to the materials of objects, or to the world."""
    for area in context.screen.areas if context.screen else ():
        if area.type == "NODE_EDITOR" and area.spaces.active.tree_type == "ShaderNodeTree":
            area.spaces.active.shader_type = kind
