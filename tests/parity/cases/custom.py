"""Attributes with one value for a whole object: attributes of instances, of objects and of the view layer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .registry import CHART, case

if TYPE_CHECKING:
    import bpy

    from ..stage import Nodes, Stage


class Geometry:
    """Builds a modifier of geometry nodes."""

    def __init__(self, data: bpy.types.BlendData, thing: bpy.types.Object) -> None:
        self.tree = data.node_groups.new("Geometry", "GeometryNodeTree")
        for direction in ("INPUT", "OUTPUT"):
            self.tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
        self.own = self.tree.nodes.new("NodeGroupInput").outputs[0]
        self._end = self.tree.nodes.new("NodeGroupOutput")
        thing.modifiers.new("Geometry", "NODES").node_group = self.tree

    def _link(self, kind: str, **inputs: Any) -> bpy.types.Node:
        node = self.tree.nodes.new(f"GeometryNode{kind}")
        for name, value in inputs.items():
            self.tree.links.new(value, node.inputs[name])
        return node

    def of(self, thing: bpy.types.Object, as_instance: bool) -> Any:
        """The geometry of another object, as an instance or not."""
        node = self._link("ObjectInfo")
        node.inputs["Object"].default_value, node.inputs["As Instance"].default_value = thing, as_instance
        return node.outputs["Geometry"]

    def on_points(self, points: Any, instance: Any) -> Any:
        """Instances on the points."""
        return self._link("InstanceOnPoints", Points=points, Instance=instance).outputs[0]

    def joined(self, *parts: Any) -> Any:
        """All parts, joined."""
        node = self._link("JoinGeometry")
        for part in parts:
            self.tree.links.new(part, node.inputs[0])
        return node.outputs[0]

    def stored(self, instances: Any, name: str, factor: float, kind: str = "FLOAT") -> Any:
        """The instances with an attribute: index times a factor."""
        number = self.tree.nodes.new("ShaderNodeMath")
        number.operation, number.inputs[1].default_value = "MULTIPLY", factor
        self.tree.links.new(self._link("InputIndex").outputs[0], number.inputs[0])
        node = self._link("StoreNamedAttribute", Geometry=instances)
        node.domain, node.data_type, node.inputs["Name"].default_value = "INSTANCE", kind, name
        self.tree.links.new(number.outputs[0], next(i for i in node.inputs if i.name == "Value" and i.enabled))
        return node.outputs[0]

    def end(self, geometry: Any) -> None:
        """Link the modifier's output."""
        self.tree.links.new(geometry, self._end.inputs[0])


def shown(*names: str, kind: str = "INSTANCER", parts: tuple[str, ...] = ("Color",)) -> Any:
    """The sum of attribute outputs and a small constant. With the constant, nothing is black."""

    def paint(nodes: Nodes) -> Any:
        value: Any = (0.05, 0.1, 0.15)
        for name in names:
            attribute = nodes.add("Attribute", attribute_type=kind, attribute_name=name)
            for part in parts:
                value = nodes.add("VectorMath", {"Vector": value, "Vector_001": (attribute, part)}, operation="ADD")
        return value

    return paint


def shrink(thing: bpy.types.Object) -> None:
    """Shrink the mesh, not the object: instances ignore the object's scale, and they must not overlap."""
    for vertex in thing.data.vertices:
        vertex.co *= 0.35


@case(samples=CHART)
def attributes_of_instances(s: Stage) -> None:
    """Two levels of instances. The outer one also has a mesh."""
    floor, ball, box = s.chart(shown("inner", "outer", "both"))
    ball.location.z = -50.0
    shrink(box)
    box["both"] = 0.3
    plane, small = s.floor(floor.active_material, size=2.5), s.floor(size=1.2)
    plane.location.z, small.location.z = 0.3, -40.0
    nodes = Geometry(s.data, plane)
    inner = nodes.stored(nodes.on_points(nodes.of(small, as_instance=False), nodes.of(box, as_instance=True)), "inner", 0.25)
    inner = nodes.stored(inner, "both", 0.1)
    outer = nodes.stored(nodes.on_points(nodes.own, nodes.joined(inner, nodes.of(box, as_instance=False))), "outer", 0.15)
    nodes.end(nodes.joined(nodes.own, nodes.stored(outer, "both", 0.05)))


@case(samples=CHART)
def attributes_of_instances_of_objects_with_instances(s: Stage) -> None:
    """Objects on points have instances of their own. If such an instance lacks an attribute, it gets the value of its object."""
    _, ball, box = s.chart(shown("inner", "outer", "lent"))
    ball.location.z = -50.0
    shrink(box)
    holder = s.floor(size=1.2)
    holder.location.z, holder["lent"] = -40.0, (0.0, 0.3, 0.1)
    nodes = Geometry(s.data, holder)
    nodes.end(nodes.stored(nodes.on_points(nodes.own, nodes.of(box, True)), "inner", 0.25))
    plane = s.floor(size=2.5)
    plane.location.z, plane["lent"] = 0.3, (0.4, 0.0, 0.2, 0.5)
    nodes = Geometry(s.data, plane)
    nodes.end(nodes.stored(nodes.on_points(nodes.own, nodes.of(holder, True)), "outer", 0.15))


@case(samples=CHART)
def attributes_of_objects(s: Stage) -> None:
    """Custom properties of the object and of its data, and Blender's own properties by path."""
    _, ball, box = s.chart(shown("tint", "data", "location", "pass_index", "missing", kind="OBJECT", parts=("Color", "Fac", "Alpha")))
    ball["tint"], ball.data["data"], ball.pass_index = (0.1, 0.2, 0.3, 0.4), 0.2, 1
    box["tint"], box.data["tint"], box["data"] = 0.3, 5.0, (0.3, 0.1)


@case(samples=CHART)
def attributes_of_the_view_layer(s: Stage) -> None:
    s.chart(shown("layer", "scene", "world", kind="VIEW_LAYER"))
    s.scene.view_layers[0]["layer"] = 0.2
    s.scene["layer"], s.scene["scene"] = 3.0, (0.1, 0.0, 0.3)
    s.scene.world["world"] = (0.0, 0.25, 0.0)
