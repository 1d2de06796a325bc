"""Node trees for tests, the shaders that the exporter makes from them, and the exporter's notes."""

from typing import Any

import bpy

from addon.export.materials import read_material
from addon.export.resources import Resources
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import Closure, Instruction, Node, Shader, Value


def node(tree: bpy.types.NodeTree, kind: str, *, into: Any = None, output: int | str = 0, **inputs: Any) -> bpy.types.Node:
    """A new node. `into`: a socket to link its output to. `inputs`: values or outputs by name, with _ for a space."""
    new = tree.nodes.new(kind)
    for name, value in inputs.items():
        socket = new.inputs[name.replace("_", " ")]
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    if into is not None:
        tree.links.new(new.outputs[output], into)
    return new


def surface(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    """The output's socket for a shader."""
    return next(n for n in tree.nodes if n.bl_idname.startswith("ShaderNodeOutput")).inputs["Surface"]


def lines(scene: SceneData) -> list[str]:
    """The coverage list of a scene."""
    return [f"{loss.object}, {loss.where}: {loss.detail}" for loss in scene.coverage]


def put(material: bpy.types.Material, kind: str, **inputs: Any) -> bpy.types.Node:
    """Link a new shader to the surface."""
    return node(material.node_tree, kind, into=surface(material.node_tree), **inputs)


def color_of(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    """The colour socket of a new Emission shader as the surface: the simplest probe."""
    return node(tree, "ShaderNodeEmission", into=surface(tree)).inputs["Color"]


def probe(tree: bpy.types.NodeTree, kind: str, output: int | str = 0, **inputs: Any) -> bpy.types.Node:
    """Link a new node to the socket of `color_of`."""
    return node(tree, kind, into=color_of(tree), output=output, **inputs)


def read(material: bpy.types.Material, resources: Resources | None = None) -> tuple[Shader, list[str]]:
    """(shader, notes as lines without the material's name)."""
    shader, notes = read_material(material, resources or Resources())
    prefix = f"material '{material.name}'"
    assert all(where.startswith(prefix) for where, _ in notes)
    return shader, [f"{where.removeprefix(prefix).removeprefix(', ')}: {detail}" for where, detail in notes]


def tree_of(shader: Shader, value: Value) -> Any:
    """A value as a tree: a constant, or a step as (op, mode, options, inputs) without empty parts."""
    if not isinstance(value, Node):
        return value
    step: Instruction = shader.code[value.index]
    inputs = tuple(tree_of(shader, v) for v in step.inputs)
    return tuple(part for part in (step.op, step.mode, step.options, inputs) if part not in ("", ()))


def only(shader: Shader) -> Closure:
    """The only closure of a shader."""
    (closure,) = shader.closures
    return closure


def color(material: bpy.types.Material, resources: Resources | None = None) -> Any:
    """The value at `color_of` as a tree. Asserts that there are no notes."""
    shader, notes = read(material, resources)
    assert notes == []
    return tree_of(shader, only(shader).inputs["color"])
