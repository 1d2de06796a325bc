"""The surroundings as a shader."""

import bpy

from blender_rl_guiding.scene.description import VISIBLE, Closure, Loss, Shader

from .materials import has_nodes
from .network import At, Network, link_to, triple
from .resources import Resources
from .shaders import closures_at
from .visibility import RAY_KINDS


def read_world(world: bpy.types.World | None, resources: Resources) -> tuple[Shader, list[Loss]]:
    """As in Cycles no world is black, and a world without nodes is its colour."""
    if world is None:
        return Shader(""), []
    if not has_nodes(world):
        return Shader(world.name, (), (Closure("emission", 1.0, {"color": triple(world.color)}),)), []
    network = Network(resources, world=True)
    output = world.node_tree.get_output_node("CYCLES")
    closures = _read_output(At(network, output, ())) if output else ()
    return Shader(world.name, network.code, closures), [Loss(world.name, where, detail) for where, detail in network.notes]


def _read_output(at: At) -> tuple[Closure, ...]:
    if link_to(at.node.inputs["Volume"]):
        at.note("the volume is left out", "Volume")
    return tuple(closures_at(at.network, at.node.inputs["Surface"]))


def world_visibility(world: bpy.types.World | None) -> int:
    """The kinds of rays that see the world, as a sum. Cycles has no switch for shadow rays: they see it."""
    rays = getattr(world, "cycles_visibility", None)  # not there while Cycles is switched off
    if rays is None:
        return VISIBLE
    return VISIBLE & ~sum(bit for kind, bit in RAY_KINDS.items() if kind != "shadow" and not getattr(rays, kind))
