"""Attributes with one value for an object: of instances by geometry nodes, of objects, of the view layer."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import bpy
import numpy as np

from blender_rl_guiding.scene.description import Loss

from .attributes import colors_of
from .geometry import read_array

_UNUSED = 2**31 - 1  # in `persistent_id`
_PARTS = ("mesh", "volume", "curves", "pointcloud", "grease_pencil")  # parts of a geometry other than its instances
# Types of objects with a geometry. For other types, such as an Empty that shows a collection, Blender raises an error.
_GEOMETRIES = {"MESH", "CURVE", "SURFACE", "FONT", "META", "CURVES", "POINTCLOUD", "VOLUME", "GREASEPENCIL"}
_OWN = {"MESH": "mesh", "VOLUME": "volume", "CURVE": "curves", "FONT": "curves", "CURVES": "curves", "POINTCLOUD": "pointcloud"}
_NOTHING = (0.0, 0.0, 0.0, 0.0)

Color4 = tuple[float, float, float, float]


class _Level:
    """A geometry with instances; each of these may be a level of its own."""

    def __init__(self, geometry: Any, own: str = "") -> None:
        self._geometry = geometry  # a reference, so that Blender does not free the points
        self._points = geometry.instances_pointcloud()
        # If the geometry has other parts, the path to an instance begins with a number for the component "instances".
        self.beside = any(getattr(geometry, part) is not None for part in _PARTS if part != own)
        self._below: dict[int, _Level | _Members | None] = {}
        self._colors: dict[str, np.ndarray | None] = {}
        count, given = len(self._points.points), self._points.attributes.get("id")
        ids = read_array(given.data, "value", (), np.int32).tolist() if given else range(count)
        self.places = {number: place for place, number in reversed([*enumerate(ids)])}  # among equal ids the first counts
        self._references = geometry.instance_references()
        self._chosen = read_array(self._points.attributes[".reference_index"].data, "value", (), np.int32)

    def below(self, place: int) -> "_Level | _Members | None":
        """The level of an instance; None if it has no instances itself."""
        reference = int(self._chosen[place])
        if reference not in self._below:
            what = self._references[reference]
            self._below[reference] = _of_geometry(what) if isinstance(what, bpy.types.GeometrySet) else _of_id(what)
        return self._below[reference]

    def color(self, name: str, place: int) -> Color4 | None:
        """The value of an attribute at an instance; None if there is no such attribute."""
        if name not in self._colors:
            attribute = self._points.attributes.get(name)
            self._colors[name] = colors_of(attribute) if attribute else None
        colors = self._colors[name]
        return None if colors is None else tuple(colors[place].tolist())


class _Members:
    """The objects of a collection, by number. They have no instance attributes; but their own instances may have some."""

    beside = False

    def __init__(self, objects: Mapping[int, bpy.types.Object]) -> None:
        self._objects = objects
        self.places = {number: number for number in objects}
        self._below: dict[int, _Level | _Members | None] = {}

    def below(self, place: int) -> "_Level | _Members | None":
        """The level of an object; None if it has no instances."""
        if place not in self._below:
            self._below[place] = _of_id(self._objects[place])
        return self._below[place]

    def color(self, name: str, place: int) -> None:
        """None: there are no attributes."""


def _of_geometry(geometry: Any, own: str = "") -> _Level | None:
    return _Level(geometry, own) if geometry.instances_pointcloud() is not None else None


def _of_id(thing: bpy.types.Object | bpy.types.Collection) -> _Level | _Members | None:
    """The level of an object with instances, or of a collection that geometry nodes instance; None for others."""
    if isinstance(thing, bpy.types.Collection):
        # Each rendered object has two numbers: one for itself and one for its instances.
        shown = {member.as_pointer() for member in _members(thing)}
        objects = [member for member in thing.all_objects if member.as_pointer() in shown]
        return _Members({n: objects[n // 2] for n in range(2 * len(objects))})
    found = _of_geometry(thing.evaluated_geometry(), _OWN.get(thing.type, "")) if thing.type in _GEOMETRIES else None
    if found is None and thing.instance_type == "COLLECTION" and thing.instance_collection:
        return _Members(dict(enumerate(thing.instance_collection.all_objects)))
    return found


def _members(collection: bpy.types.Collection) -> Iterator[bpy.types.Object]:
    """The objects of a collection that render."""
    if not collection.hide_render:
        yield from (thing for thing in collection.objects if not thing.hide_render)
        for child in collection.children:
            yield from _members(child)


class CustomAttributes:
    """Looks up attributes of the types OBJECT, INSTANCER and VIEW_LAYER, in Cycles' order."""

    def __init__(self, depsgraph: bpy.types.Depsgraph) -> None:
        self._depsgraph = depsgraph
        self._levels: dict[int, _Level | _Members | None] = {}  # of instancers
        self.losses: dict[Loss, None] = {}  # an ordered set

    def find(self, kind: str, name: str, instance: bpy.types.DepsgraphObjectInstance) -> Color4:
        """Linear RGBA; zeros if there is no such attribute."""
        found = (color for color in self._candidates(kind, name, instance) if color is not None)
        return next(found, _NOTHING)

    def _candidates(self, kind: str, name: str, instance: bpy.types.DepsgraphObjectInstance) -> Iterator[Color4 | None]:
        if kind == "VIEW_LAYER":
            owners = (self._depsgraph.view_layer, self._depsgraph.scene, self._depsgraph.scene.world)
            yield from (_property(owner, name) for owner in owners if owner)
            return
        if kind == "INSTANCER" and instance.is_instance:
            if instance.particle_system:
                yield _property(instance.particle_system.settings, name)
            yield from (level.color(name, place) for level, place in reversed(self._places(instance)))
            yield from _of_thing(instance.parent, name)
        yield from _of_thing(instance.object, name)

    def _places(self, instance: bpy.types.DepsgraphObjectInstance) -> Sequence[tuple[_Level | _Members, int]]:
        """The instances that contain an instance, outermost first: level and index in this level."""
        key, found = instance.parent.as_pointer(), []
        if key not in self._levels:
            self._levels[key] = _of_id(instance.parent)
        level, path = self._levels[key], [number for number in reversed(instance.persistent_id) if number != _UNUSED]
        while level is not None and (path := path[1:] if level.beside else path):
            place = level.places.get(path[0])
            if place is None:
                self.losses[Loss(instance.parent.name, "instances", "some have the id of another: they lack its attributes")] = None
                break
            found.append((level, place))
            level, path = level.below(place), path[1:]
        return found


def _of_thing(thing: bpy.types.Object, name: str) -> Iterator[Color4 | None]:
    yield _property(thing, name)
    if thing.data:
        yield _property(thing.data, name)


def _property(owner: Any, name: str) -> Color4 | None:
    """A custom property, or one of Blender's own by its path, if it is a number or up to four."""
    value = owner.get(name)
    if value is None:
        try:
            value = owner.path_resolve(name)
        except ValueError:  # no such path
            return None
    if isinstance(value, int | float):
        return float(value), float(value), float(value), 1.0
    try:
        numbers = [float(number) for number in value] if not isinstance(value, str) else []
    except (TypeError, ValueError):  # no numbers
        return None
    if not 1 <= len(numbers) <= 4:
        return None
    x, y, z, w = numbers + [0.0, 0.0, 0.0, 1.0][len(numbers) :]
    return x, y, z, w
