"""Walks a node tree against its links, and writes the code that computes the value of a socket."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import bpy

from blender_rl_guiding.scene.description import Color, Instruction, Node, Value
from blender_rl_guiding.scene.ops import fault

from .resources import Resources

Path = tuple[bpy.types.Node, ...]  # the group nodes that lead to a node tree, outermost first
Reader = Callable[["At", str], Value | None]  # (a node, identifier of an output) -> its value; None, with a note, if it is not supported
_NUMBERS = {"VALUE", "INT", "BOOLEAN"}  # types of sockets


class Network:
    """The growing code of one shader, and `notes`: `where` and `detail` of its losses."""

    lamp = False  # whether the shader is a lamp's

    def __init__(self, readers: Mapping[str, Reader], resources: Resources, *, world: bool = False, pass_index: int = 0) -> None:
        """`readers`: one for each `bl_idname` of a node. `pass_index`: of the material."""
        self.readers, self.resources, self.world, self.pass_index = readers, resources, world, pass_index
        self.notes: dict[tuple[str, str], None] = {}  # an ordered set
        self.distant = world  # whether the shaded point is infinitely far away
        self._steps: dict[Instruction, Node] = {}
        self._outputs: dict[tuple[int, ...], Value | None] = {}

    @property
    def code(self) -> tuple[Instruction, ...]:
        """All steps so far."""
        return tuple(self._steps)

    def add(self, op: str, *inputs: Value, mode: str = "", options: tuple[int, ...] = ()) -> Node:
        """The value of a step. Equal steps are stored once."""
        problem = fault(op, mode, len(inputs), len(options))
        assert not problem, f"{op}: {problem}"
        return self._steps.setdefault(Instruction(op, inputs, mode, tuple(int(n) for n in options)), Node(len(self._steps)))

    def attribute(self, kind: str, name: str = "") -> Value:
        """The value of a corner attribute."""
        return self.add("attribute", options=(self.resources.corner_attribute(kind, name),))

    def object_attribute(self, name: str) -> Value:
        """The value of an object attribute."""
        return self.add("object_attribute", options=(self.resources.object_attribute(name),))

    def light_path(self, mode: str) -> Value:
        """A property of the ray, by a mode of `ops.Light`."""
        return self.add("light_path", mode=mode)

    def arriving(self, socket: bpy.types.NodeSocket, path: Path) -> Value | None:
        """The value of an input's link, in the input's type; None without a link, or if the reader returns None."""
        link = link_to(socket)
        if link is None:
            return None
        value = self._output(link.from_socket, path)
        return None if value is None else self._converted(value, link.from_socket.type, socket.type)

    def value(self, socket: bpy.types.NodeSocket, path: Path) -> Value:
        """The value of an input: from its link if there is one, otherwise its own value."""
        arriving = self.arriving(socket, path)
        return unlinked(socket) if arriving is None else arriving

    def shader(self, socket: bpy.types.NodeSocket, path: Path = ()) -> "At | None":
        """The shader node that is linked to an input, through groups, reroutes and muted nodes."""
        link = link_to(socket)
        if link is None:
            return None
        if not _hands_on(link.from_node):
            return At(self, link.from_node, path)
        inner = _handed_on(link.from_socket, path)
        return self.shader(*inner) if inner else None

    def _output(self, socket: bpy.types.NodeSocket, path: Path) -> Value | None:
        key = (socket.as_pointer(), *(group.as_pointer() for group in path))
        if key not in self._outputs:
            self._outputs[key] = self._read(socket, path)
        return self._outputs[key]

    def _read(self, socket: bpy.types.NodeSocket, path: Path) -> Value | None:
        return self._relayed(socket, path) if _hands_on(socket.node) else self.read(At(self, socket.node, path), socket.identifier)

    def read(self, at: "At", output: str) -> Value | None:
        """The value of the output with this identifier; None, with a note, if no reader supports it."""
        if at.node.bl_idname in self.readers:
            return self.readers[at.node.bl_idname](at, output)
        at.note(f"{at.node.bl_label} is not supported: the unlinked values of the sockets that it leads to stand in")
        return None

    def _relayed(self, socket: bpy.types.NodeSocket, path: Path) -> Value | None:
        inner = _handed_on(socket, path)
        if inner is None:
            return None
        # As in Cycles, unlinked inputs of groups pass on their own values; unlinked inputs of reroutes and muted nodes do not.
        own = _is_group(socket.node) and not socket.node.mute
        value = self.value(*inner) if own else self.arriving(*inner)
        return None if value is None else self._converted(value, inner[0].type, socket.type)

    def _converted(self, value: Value, source: str, target: str) -> Value:
        """A value in the type of another socket, as in Cycles. A number is a colour and a vector already."""
        if target in _NUMBERS and source not in _NUMBERS:
            return self.add("luminance" if source == "RGBA" else "average", value)
        return value


@dataclass(frozen=True)
class At:
    """A node in its groups, with the methods that readers need."""

    network: Network
    node: bpy.types.Node
    path: Path

    def value(self, identifier: str, implicit: Callable[[], Value] | None = None) -> Value:
        """The value of the input with this identifier: from its link, otherwise from `implicit()`, otherwise its own value."""
        socket = find(self.node.inputs, identifier)
        if implicit is None:
            return self.network.value(socket, self.path)
        arriving = self.network.arriving(socket, self.path)
        return implicit() if arriving is None else arriving

    def direction(self, identifier: str) -> Value | None:
        """A normal or tangent; None for the surface's own."""
        arriving = self.network.arriving(find(self.node.inputs, identifier), self.path)
        return None if arriving in (None, 0.0, (0.0, 0.0, 0.0)) else arriving

    def normal(self) -> tuple[Value, ...]:
        """The last input of an op with a normal; () for the surface's own."""
        normal = self.direction("Normal")
        return () if normal is None else (normal,)

    def linked(self, identifier: str) -> bool:
        """Whether there is a link to an input."""
        return link_to(find(self.node.inputs, identifier)) is not None

    def add(self, op: str, *inputs: Value, mode: str = "", options: tuple[int, ...] = ()) -> Node:
        """See `Network.add`."""
        return self.network.add(op, *inputs, mode=mode, options=options)

    def attribute(self, kind: str, name: str = "") -> Value:
        """See `Network.attribute`."""
        return self.network.attribute(kind, name)

    def note(self, detail: str, socket: str = "") -> None:
        """Add a loss of this node: what is lost, and its substitute."""
        where = [f"group '{group.node_tree.name}'" for group in self.path] + [f"node '{self.node.name}'"]
        where += [f"socket '{socket}'"] if socket else []
        self.network.notes[", ".join(where), detail] = None


def step(op: str, *sockets: str, mode: str = "") -> Reader:
    """Reads a node as one step on the values of these sockets."""
    return lambda at, _output: at.add(op, *map(at.value, sockets), mode=mode)


def find(sockets: bpy.types.NodeInputs, identifier: str) -> bpy.types.NodeSocket:
    """The socket of an identifier, hidden or not. Names are not unique."""
    return next(socket for socket in sockets if socket.identifier == identifier)


def link_to(socket: bpy.types.NodeSocket) -> bpy.types.NodeLink | None:
    """The link to an input that is in effect."""
    links = (link for link in socket.links if link.is_valid and not link.is_muted and not link.from_socket.is_unavailable)
    return None if socket.is_unavailable else next(links, None)


def unlinked(socket: bpy.types.NodeSocket) -> Value:
    """The own value of an input, or of an output that has one."""
    value = socket.default_value
    return float(value) if isinstance(value, int | float) else triple(value)


def triple(values: Sequence[float]) -> Color:
    """The first three of Blender's numbers, without an alpha."""
    x, y, z = values[:3]
    return float(x), float(y), float(z)


def _hands_on(node: bpy.types.Node) -> bool:
    """Whether a node passes on its inputs unchanged."""
    return node.mute or node.bl_idname == "NodeReroute" or _is_group(node)


def _is_group(node: bpy.types.Node) -> bool:
    return node.bl_idname in ("ShaderNodeGroup", "NodeGroupInput")


def _handed_on(output: bpy.types.NodeSocket, path: Path) -> tuple[bpy.types.NodeSocket, Path] | None:
    """The input that such a node passes on to this output, and the path of this input."""
    node = output.node
    if node.bl_idname == "NodeReroute":
        return node.inputs[0], path
    if node.mute:
        inner = next((link.from_socket for link in node.internal_links if link.to_socket == output), None)
        return (inner, path) if inner else None
    if node.bl_idname == "NodeGroupInput":
        return find(path[-1].inputs, output.identifier), path[:-1]
    ends = (n for n in node.node_tree.nodes if n.bl_idname == "NodeGroupOutput" and n.is_active_output) if node.node_tree else ()
    return next(((find(end.inputs, output.identifier), (*path, node)) for end in ends), None)
