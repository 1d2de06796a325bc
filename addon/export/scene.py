"""Puts the bundle together from what the other files of this folder read."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import ARRAYS, SceneData, fault_of_lamp, fault_of_shader, find_fault, find_nothing
from blender_rl_guiding.scene.description import SHADOW, Camera, Lamp, Loss, Shader

from . import coverage
from .attributes import Attributes, Placed
from .camera import read_camera
from .culling import Culling
from .custom_attributes import CustomAttributes
from .film import read_bounces, read_film
from .geometry import Mesh, Triangles, check_transform, evaluated_mesh, place, read_mesh
from .lamps import read_lamp
from .materials import read_material
from .motion import FrameSet, of_motion
from .object_info import object_attribute
from .resources import Resources, corner_attributes_of
from .simplify import texture_limit
from .visibility import visibility
from .world import read_world, world_visibility

# What Blender and numpy raise where the data of an object are not what they should be.
_UNREADABLE = (InputError, ArithmeticError, LookupError, RuntimeError, ValueError)


class Collector:
    """Grows the scene instance by instance; each mesh and each material is read once."""

    def __init__(self, depsgraph: bpy.types.Depsgraph, frame: Camera) -> None:
        """`frame` is the camera without a render region."""
        self.triangles: dict[str, list[np.ndarray]] = {"vertices": [], "triangles": [], "normals": [], "material": [], "object": []}
        self.visibility: list[int] = []
        self.object_info: list[dict[str | tuple[str, str, str], tuple[float, float, float]]] = []
        self.shaders: list[Shader] = []
        self.lamps: list[Lamp] = []
        self.losses: dict[Loss, None] = {}  # an ordered set
        self.resources = Resources(texture_limit(depsgraph.scene))
        self.attributes = Attributes()
        self._depsgraph = depsgraph
        self._culling = Culling(depsgraph.scene, frame)
        self.custom = CustomAttributes(depsgraph)
        self._vertices = 0
        self._meshes: dict[int, Mesh] = {}
        self._tangents: dict[tuple[int, str], tuple[np.ndarray, np.ndarray]] = {}
        self._shaders: dict[int, tuple[int, tuple[tuple[str, str], ...]]] = {}

    def note(self, losses: Iterable[Loss]) -> None:
        """Lines for the coverage report."""
        self.losses.update(dict.fromkeys(losses))

    def add(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """Take one instance, if it is a lamp or a mesh that any rays can see. What cannot be read is left out as a whole, and listed."""
        try:
            self._add(instance)
        except _UNREADABLE as error:
            reason = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
            self.note([Loss(instance.object.name, "", f"left out, as it cannot be read: {reason}")])

    def _add(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        thing, matrix = instance.object, np.array(instance.matrix_world, np.float64)
        if thing.type != "LIGHT" and self._culling.leaves_out(thing, matrix):
            return
        self.note(coverage.of_instance(instance, self._depsgraph.view_layer))
        if not instance.show_self:
            return
        seen = visibility(instance, self._depsgraph.view_layer)
        if thing.type == "LIGHT":
            self._add_lamp(thing, matrix, seen)
        elif isinstance(thing.data, bpy.types.Mesh) and seen:
            with evaluated_mesh(thing) as data:
                self._add_mesh(instance, data, matrix, seen)

    def _add_lamp(self, thing: bpy.types.Object, matrix: np.ndarray, seen: int) -> None:
        if not seen & ~SHADOW:
            return  # what nothing sees lights nothing
        check_transform(matrix)
        lamp, losses = read_lamp(thing, matrix, seen)
        if lamp and (fault := fault_of_lamp(lamp)):
            raise InputError(fault)
        self.lamps += [lamp] if lamp else []
        self.note(losses)

    def _add_mesh(self, instance: bpy.types.DepsgraphObjectInstance, data: bpy.types.Mesh, matrix: np.ndarray, seen: int) -> None:
        thing = instance.object
        # The evaluated mesh lives as long as the depsgraph, so its address identifies it.
        key = thing.data.as_pointer()
        if key not in self._meshes:
            self._meshes[key] = read_mesh(data)
        part = place(self._meshes[key], matrix)
        if not len(part.corners):
            return
        material = self._indices(thing, part.slots)
        self.note(coverage.of_linking(thing, [self.shaders[index] for index in np.unique(material)]))
        # First the object, then its attributes, then its triangles: if something fails, there is an object without triangles.
        self.object_info.append({name: object_attribute(name, instance, self.custom) for name in self.resources.object_attributes})
        self.visibility.append(seen)
        self._add_attributes(thing.name, material, Placed(key, data, self._meshes[key], part, matrix, self._depsgraph, self._tangents))
        self._add_triangles(part, material)

    def _add_triangles(self, part: Triangles, material: np.ndarray) -> None:
        own = np.full(len(material), len(self.visibility) - 1, np.int32)
        arrays = (part.vertices, part.corners + np.int32(self._vertices), part.normals, material, own)
        for parts, array in zip(self.triangles.values(), arrays, strict=True):
            parts.append(array)
        self._vertices += len(part.vertices)

    def _add_attributes(self, name: str, material: np.ndarray, placed: Placed) -> None:
        used = np.flatnonzero(np.bincount(material))
        for number in sorted(set().union(*(corner_attributes_of(self.shaders[index]) for index in used))):
            key = self.resources.corner_attributes[number]
            if not self.attributes.add(number, key, len(self.visibility) - 1, placed):
                self.note([Loss(name, f"attribute '{key[1] or key[0]}'", "numbers that are not finite: 0 stands in for them")])

    def _indices(self, thing: bpy.types.Object, slots: np.ndarray) -> np.ndarray:
        """(T,) indices of `shaders` for the material slots of an object's faces; slots that no face uses leave no trace."""
        present = [slot.material for slot in thing.material_slots] or [None]
        slots = np.clip(slots, 0, len(present) - 1)  # as in Cycles
        table = np.zeros(len(present), np.int32)
        for slot in np.flatnonzero(np.bincount(slots)):
            table[slot], notes = self._shader(present[slot])
            self.note(Loss(thing.name, where, detail) for where, detail in notes)
        return table[slots]

    def _shader(self, material: bpy.types.Material | None) -> tuple[int, tuple[tuple[str, str], ...]]:
        key = material.as_pointer() if material else 0
        if key not in self._shaders:
            shader, notes = read_material(material, self.resources)
            if fault := fault_of_shader(shader):
                raise InputError(fault)
            self._shaders[key] = len(self.shaders), tuple(notes)
            self.shaders.append(shader)
        return self._shaders[key]

    def joined(self) -> dict[str, np.ndarray]:
        """The arrays of `SceneData` that triangles have. What they are made from is let go of, array by array."""
        self._meshes.clear()
        return {name: _joined(name, parts) for name, parts in self.triangles.items()}

    def object_attributes(self) -> np.ndarray:
        """What `SceneData` calls so. What an object has not been asked for when it was added, none of its shaders reads."""
        rows = [[info.get(name, (0.0, 0.0, 0.0)) for info in self.object_info] for name in self.resources.object_attributes]
        return np.array(rows, np.float32).reshape(len(rows), len(self.object_info), 3)


class Stopped(Exception):  # noqa: N818  # it is no error
    """The user has enough."""


def export(depsgraph: bpy.types.Depsgraph, frame_set: FrameSet, stop: Callable[[], bool] = lambda: False) -> SceneData:
    """The scene of a depsgraph in render mode. InputError names what makes it impossible to render.

    `frame_set` is that of the engine which renders the depsgraph.
    `stop` is asked before each instance; Stopped where it says yes.
    """
    scene = depsgraph.scene
    name = Path(bpy.data.filepath).name or scene.name
    try:
        data = _export(depsgraph, Path(name).stem, frame_set, stop)
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
    if fault := find_fault(data):
        raise InputError(f"{name}: {fault}")
    if nothing := find_nothing(data):
        return replace(data, coverage=(*data.coverage, Loss(scene.name, "", nothing)))
    return data


def _export(depsgraph: bpy.types.Depsgraph, name: str, frame_set: FrameSet, stop: Callable[[], bool]) -> SceneData:
    scene, collector = depsgraph.scene, Collector(depsgraph, read_camera(depsgraph, whole=True)[0])
    camera, camera_losses = read_camera(depsgraph)
    world, world_losses = _world(scene.world, collector.resources)
    for instance in depsgraph.object_instances:
        if stop():
            raise Stopped
        collector.add(instance)
    collector.note((*collector.custom.losses, *of_motion(depsgraph, frame_set)))
    attributes, rows = collector.attributes.arrays(len(collector.resources.corner_attributes), len(collector.visibility))
    return SceneData(
        name=name,
        **collector.joined(),
        shaders=tuple(collector.shaders),
        camera=camera,
        world=world,
        world_visibility=world_visibility(scene.world),
        lamps=tuple(collector.lamps),
        film=read_film(scene),
        bounces=read_bounces(scene),
        visibility=np.array(collector.visibility, np.uint8),
        attributes=attributes,
        attribute_rows=rows,
        object_attributes=collector.object_attributes(),
        tables=collector.resources.tables,
        textures=tuple(collector.resources.textures),
        coverage=(
            *coverage.of_scene(scene, depsgraph.view_layer),
            *coverage.of_shaders(scene, collector.shaders),
            *coverage.of_links(depsgraph),
            *camera_losses,
            *world_losses,
            *collector.losses,
        ),
    )


def _world(world: bpy.types.World | None, resources: Resources) -> tuple[Shader, list[Loss]]:
    """As `read_world`, black where a number is not finite; nothing is lost of what nothing sees."""
    shader, losses = read_world(world, resources)
    if fault := fault_of_shader(shader):
        shader, losses = Shader(shader.name), [*losses, Loss(shader.name, "", f"black stands in: {fault}")]
    return shader, losses if world_visibility(world) & ~SHADOW else []


def _joined(name: str, parts: list[np.ndarray]) -> np.ndarray:
    dtype, shape = ARRAYS[name]
    whole = np.ascontiguousarray(parts[0]) if len(parts) == 1 else np.concatenate([np.empty([n or 0 for n in shape], dtype), *parts])
    parts.clear()
    return whole
