"""Materials as shaders."""

import bpy

from blender_rl_guiding.scene.description import Closure, Shader

from .network import At, Network, link_to, triple
from .nodes import READERS
from .resources import Resources
from .shaders import closures_at

Notes = tuple[tuple[str, str], ...]  # `where` and `detail` of losses


def read_material(material: bpy.types.Material | None, resources: Resources) -> tuple[Shader, Notes]:
    """A material's shader. As in Cycles, an empty slot is a Principled BSDF, a material without nodes has its viewport colour, and a
    material without a surface is black.
    """
    if material is None:
        return Shader("", (), (Closure("principled", 1.0),)), ()
    if not has_nodes(material):
        return Shader(material.name, (), (Closure("diffuse", 1.0, {"color": triple(material.diffuse_color)}),)), ()
    network = Network(READERS, resources, pass_index=material.pass_index)
    output = material.node_tree.get_output_node("CYCLES")
    closures = _read_output(At(network, output, ())) if output else ()
    shader = Shader(material.name, network.code, closures)
    notes = [*network.notes, *_of_shadows(material, shader)]
    return shader, tuple((", ".join(filter(None, (f"material '{material.name}'", where))), detail) for where, detail in notes)


def has_nodes(owner: bpy.types.Material | bpy.types.World) -> bool:
    """Whether a material or world uses nodes."""
    return owner.node_tree is not None and (bpy.app.version >= (5, 0) or owner.use_nodes)


def _read_output(at: At) -> tuple[Closure, ...]:
    inputs = at.node.inputs
    if link_to(inputs["Displacement"]):
        at.note("the surface is not displaced", "Displacement")
    if link_to(inputs["Volume"]):
        at.note("the volume is left out", "Volume")
        if not link_to(inputs["Surface"]):
            return (Closure("transparent", 1.0, {"color": (1.0, 1.0, 1.0)}),)  # a volume alone has no surface
    return tuple(closures_at(at.network, inputs["Surface"]))


def _of_shadows(material: bpy.types.Material, shader: Shader) -> Notes:
    transparent = any(closure.kind == "transparent" or closure.inputs.get("alpha", 1.0) != 1.0 for closure in shader.closures)
    if transparent and not material.use_transparent_shadow:
        return (("", "transparent shadows are off: its shadows are transparent"),)
    return ()
