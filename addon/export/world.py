"""The world as a shader. A picture replaces each unsupported node."""

from pathlib import Path

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.leftovers import temporary_folder
from blender_rl_guiding.scene.data import Texture
from blender_rl_guiding.scene.description import VISIBLE, Closure, Loss, Shader, Value
from blender_rl_guiding.scene.ops import Interpolation, Projection
from blender_rl_guiding.strings import one_line

from . import by_cycles
from .materials import has_nodes
from .network import At, Network, link_to, triple
from .nodes import READERS
from .resources import Resources
from .shaders import closures_at
from .visibility import RAY_KINDS

_PICTURE = (512, 1024, 3)
# Nodes that read other properties of a ray than its direction, so a picture cannot replace them.
_OF_RAYS = ("ShaderNodeTexCoord", "ShaderNodeCameraData", "ShaderNodeLightPath")


class _WorldNetwork(Network):
    """Lets Cycles render a picture of each unsupported node."""

    def __init__(self, resources: Resources, world: bpy.types.World, frame: float) -> None:
        super().__init__(READERS, resources, world=True)
        self._world, self._frame = world, frame

    def read(self, at: At, output: str) -> Value | None:
        notes = dict(self.notes)
        value = super().read(at, output)
        if value is not None or at.node.bl_idname in _OF_RAYS:
            return value
        try:
            picture = _picture(at, output, self._world, self._frame)
        except InputError as error:
            at.note(f"there is no picture of it either: {error}", output)
            return None
        self.notes = notes
        at.note(f"{at.node.bl_label} is not supported: a picture of it stands in", output)
        texture = self.resources.texture((at.node.as_pointer(), output, *(group.as_pointer() for group in at.path)), lambda: picture)
        return self.add("environment", self.add("position"), options=(texture, Projection.EQUIRECTANGULAR, Interpolation.LINEAR))


def _picture(at: At, output: str, world: bpy.types.World, frame: float) -> Texture:
    """The output of a node in all directions. InputError if Blender fails."""
    with temporary_folder() as folder:
        blend = _file_with(world.original, Path(folder, "world.blend"))
        groups = [group.name for group in at.path]
        job = {"blend": str(blend), "world": world.name, "groups": groups, "node": at.node.name, "output": output, "frame": frame}
        colors = by_cycles.render(job, Path(folder, "picture.npz"), at.network.resources.stop, picture=_PICTURE)["picture"][::-1]
    return Texture(at.node.name, False, by_cycles.opaque(colors))


def _file_with(world: bpy.types.World, path: Path) -> Path:
    """A file that contains a world. For a linked world its library, because Blender would write only the link; otherwise a new file."""
    if world.library:
        return Path(bpy.path.abspath(world.library.filepath))
    try:
        bpy.data.libraries.write(str(path), {world}, path_remap="ABSOLUTE")
    except (RuntimeError, OSError) as error:
        raise InputError(one_line(error)) from error
    return path


def read_world(world: bpy.types.World | None, resources: Resources, frame: float = 1.0) -> tuple[Shader, list[Loss]]:
    """The world's shader. As in Cycles, a missing world is black, and a world without nodes has its colour. Pictures of nodes use
    `frame`.
    """
    if world is None:
        return Shader(""), []
    if not has_nodes(world):
        return Shader(world.name, (), (Closure("emission", 1.0, {"color": triple(world.color)}),)), []
    network = _WorldNetwork(resources, world, frame)
    output = world.node_tree.get_output_node("CYCLES")
    closures = _read_output(At(network, output, ())) if output else ()
    return Shader(world.name, network.code, closures), [Loss(world.name, where, detail) for where, detail in network.notes]


def _read_output(at: At) -> tuple[Closure, ...]:
    if link_to(at.node.inputs["Volume"]):
        at.note("the volume is left out", "Volume")
    return tuple(closures_at(at.network, at.node.inputs["Surface"]))


def world_visibility(world: bpy.types.World | None) -> int:
    """The kinds of rays that see the world, as a sum. Cycles has no switch for shadow rays: they see it."""
    rays = getattr(world, "cycles_visibility", None)  # missing if Cycles is disabled
    if rays is None:
        return VISIBLE
    return VISIBLE & ~sum(bit for kind, bit in RAY_KINDS.items() if kind != "shadow" and not getattr(rays, kind))
