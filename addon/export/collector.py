"""Collects the triangles, shaders and lamps of all instances of a depsgraph."""

from collections.abc import Iterable
from dataclasses import replace

import bpy
import numpy as np

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import ARRAYS
from blender_rl_guiding.scene.description import SHADOW, Camera, Lamp, Loss, Shader, emits
from blender_rl_guiding.scene.faults import fault_of_lamp, fault_of_shader

from . import coverage
from .attributes import Attributes, Placed, depends_on_place
from .culling import Culling
from .custom_attributes import CustomAttributes
from .geometry import UNREADABLE, Mesh, Triangles, check_transform, evaluated_mesh, place, read_mesh
from .instances import Instances, Kind, Use, fits, kind_of, use_of
from .lamps import read_lamp
from .materials import read_material
from .object_info import ObjectInfo
from .resources import Resources, corner_attributes_of
from .simplify import texture_limit
from .stop import Stop
from .visibility import visibility


class Collector:
    """Collects instance by instance; reads each mesh and each material once.

    A mesh with a use in `repeated` is stored once if possible. For every other mesh, each instance has its own triangles in the world.
    """

    def __init__(self, depsgraph: bpy.types.Depsgraph, frame: Camera, repeated: frozenset[Use], stop: Stop) -> None:
        """`frame` is the camera of the whole frame."""
        self.triangles: dict[str, list[np.ndarray]] = {"vertices": [], "triangles": [], "normals": [], "material": [], "object": []}
        self.visibility: list[int] = []
        self.object_info = ObjectInfo()
        self.instances = Instances()
        self.shaders: list[Shader] = []
        self.lamps: list[Lamp] = []
        self.losses: dict[Loss, None] = {}  # an ordered set
        self.resources = Resources(depsgraph.scene.frame_current, texture_limit(depsgraph.scene), stop)
        self.attributes = Attributes()
        self.custom = CustomAttributes(depsgraph)
        self._depsgraph = depsgraph
        self._culling = Culling(depsgraph.scene, frame)
        self._repeated = repeated
        self._vertices = 0
        self._meshes: dict[int, Mesh] = {}
        self._seen: dict[Kind, int] = {}
        self._noted: set[tuple[Kind, bool, bool]] = set()
        self._linked: set[Kind] = set()
        self._uses: dict[Kind, Use] = {}
        self._kept_once: dict[Use, int | None] = {}  # number of the mesh; None if it cannot be stored once
        self._tangents: dict[tuple[int, str], tuple[np.ndarray, np.ndarray]] = {}
        self._lamp_shaders: dict[str, int] = {}
        self._shaders: dict[int, tuple[int, tuple[tuple[str, str], ...]]] = {}

    def note(self, losses: Iterable[Loss]) -> None:
        """Lines for the coverage report."""
        self.losses.update(dict.fromkeys(losses))

    def add(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """Add an instance if it is a lamp or a mesh and visible to any ray. If it cannot be read, it is left out completely, and listed."""
        try:
            self._add(instance)
        except UNREADABLE as error:
            reason = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
            self.note([Loss(instance.object.name, "", f"left out, as it cannot be read: {reason}")])

    def _add(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        thing, matrix = instance.object, np.array(instance.matrix_world, np.float64)
        if thing.type != "LIGHT" and self._culling.leaves_out(thing, matrix):
            return
        kind = kind_of(instance)
        self._note_kind(kind, instance)
        if not instance.show_self:
            return
        if kind not in self._seen:
            self._seen[kind] = visibility(instance, self._depsgraph.view_layer)
        seen = self._seen[kind]
        if thing.type == "LIGHT":
            self._add_lamp(instance, matrix, seen)
        elif isinstance(thing.data, bpy.types.Mesh) and seen:
            with evaluated_mesh(thing) as data:
                self._add_mesh(instance, kind, data, matrix, seen)

    def _note_kind(self, kind: Kind, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """Add the losses of an instance without its materials, only for the first instance of its kind."""
        key = kind, instance.show_self, instance.show_particles
        if key not in self._noted:
            self._noted.add(key)
            self.note(coverage.of_instance(instance, self._depsgraph.view_layer))

    def _add_lamp(self, instance: bpy.types.DepsgraphObjectInstance, matrix: np.ndarray, seen: int) -> None:
        if not seen & ~SHADOW:
            return  # invisible to all rays, so it lights nothing
        check_transform(matrix)
        lamp, shader, losses = read_lamp(instance, seen, self.resources, self._depsgraph)
        if lamp:
            self._take_lamp(lamp, shader)
        self.note(losses)

    def _take_lamp(self, lamp: Lamp, shader: Shader | None) -> None:
        if fault := fault_of_lamp(lamp) or (fault_of_shader(shader) if shader else ""):
            raise InputError(fault)
        self.lamps.append(replace(lamp, shader=self._lamp_shader(shader)) if shader else lamp)

    def _lamp_shader(self, shader: Shader) -> int:
        """The index of a lamp's shader; equal shaders have one."""
        key = repr(shader)
        if key not in self._lamp_shaders:
            self._lamp_shaders[key] = len(self.shaders)
            self.shaders.append(shader)
        return self._lamp_shaders[key]

    def _add_mesh(
        self, instance: bpy.types.DepsgraphObjectInstance, kind: Kind, data: bpy.types.Mesh, matrix: np.ndarray, seen: int
    ) -> None:
        check_transform(matrix)
        mesh = self._kept(kind, instance.object, data) if fits(instance.matrix_world) else None
        if mesh is not None:
            self._add_instance(instance, kind, mesh, matrix, seen)
        else:
            self._add_copy(instance, kind, data, matrix, seen)

    def _add_instance(self, instance: bpy.types.DepsgraphObjectInstance, kind: Kind, mesh: int, matrix: np.ndarray, seen: int) -> None:
        self.instances.object_info.add(self.resources.object_attributes, instance, self.custom)
        notes = self.instances.add(mesh, matrix, seen)
        self._note_materials(kind, instance.object, self.instances.parts["material"][mesh], notes)

    def _add_copy(
        self, instance: bpy.types.DepsgraphObjectInstance, kind: Kind, data: bpy.types.Mesh, matrix: np.ndarray, seen: int
    ) -> None:
        thing, part = instance.object, self._placed(instance.object, data, matrix)
        if not len(part.corners):
            return
        material, notes = self._indices(thing, part.slots)
        self._note_materials(kind, thing, material, notes)
        # In the order object, attributes, triangles: after a failure there is at most an object without triangles.
        self.object_info.add(self.resources.object_attributes, instance, self.custom)
        self.visibility.append(seen)
        self._add_attributes(len(self.visibility) - 1, thing, data, material, part, matrix)
        self._add_triangles(part, material)

    def _note_materials(self, kind: Kind, thing: bpy.types.Object, material: np.ndarray, notes: list[tuple[str, str]]) -> None:
        """Add the losses of an object's materials, only for the first object of its kind."""
        if kind not in self._linked:
            self._linked.add(kind)
            self.note(Loss(thing.name, where, detail) for where, detail in notes)
            self.note(coverage.of_linking(thing, [self.shaders[index] for index in np.unique(material)]))

    def _placed(self, thing: bpy.types.Object, data: bpy.types.Mesh, matrix: np.ndarray) -> Triangles:
        # An evaluated mesh lives as long as the depsgraph: its address identifies it.
        key = thing.data.as_pointer()
        if key not in self._meshes:
            self._meshes[key] = read_mesh(data)
        return place(self._meshes[key], matrix)

    def _kept(self, kind: Kind, thing: bpy.types.Object, data: bpy.types.Mesh) -> int | None:
        """The number of the mesh that instances of a kind share; None if each instance has its own triangles."""
        if kind not in self._uses:
            self._uses[kind] = use_of(thing)
        use = self._uses[kind]
        if use in self._repeated and use not in self._kept_once:
            self._kept_once[use] = None  # set before reading: after a failure the mesh is not tried again
            self._kept_once[use] = self._add_repeated(thing, data)
        return self._kept_once.get(use)

    def _add_repeated(self, thing: bpy.types.Object, data: bpy.types.Mesh) -> int | None:
        """Store a mesh once; returns its number. None if it is empty or emits, or if its attributes depend on the instance's matrix."""
        part = self._placed(thing, data, np.eye(4))
        material, notes = self._indices(thing, part.slots)
        shines = any(emits(closure) for index in np.unique(material) for closure in self.shaders[index].closures)
        local = not any(depends_on_place(self.resources.corner_attributes[number]) for number in self._corner_attributes(material))
        if shines or not local or not len(part.corners):
            return None
        mesh = self.instances.count
        self.instances.add_mesh(part, material, notes)
        self._add_attributes(~mesh, thing, data, material, part, np.eye(4))
        return mesh

    def _add_triangles(self, part: Triangles, material: np.ndarray) -> None:
        own = np.full(len(material), len(self.visibility) - 1, np.int32)
        arrays = (part.vertices, part.corners + np.int32(self._vertices), part.normals, material, own)
        for parts, array in zip(self.triangles.values(), arrays, strict=True):
            parts.append(array)
        self._vertices += len(part.vertices)

    def _add_attributes(
        self, owner: int, thing: bpy.types.Object, data: bpy.types.Mesh, material: np.ndarray, part: Triangles, matrix: np.ndarray
    ) -> None:
        """Add the attributes that the materials read: those of an object, or of the mesh ~owner."""
        key = thing.data.as_pointer()
        placed = Placed(key, data, self._meshes[key], part, matrix, self._depsgraph, self._tangents)
        for number in self._corner_attributes(material):
            kind, name = self.resources.corner_attributes[number]
            if not self.attributes.add(number, (kind, name), owner, placed):
                self.note([Loss(thing.name, f"attribute '{name or kind}'", "numbers that are not finite: 0 stands in for them")])

    def _corner_attributes(self, material: np.ndarray) -> list[int]:
        used = np.flatnonzero(np.bincount(material))
        return sorted(set().union(*(corner_attributes_of(self.shaders[index]) for index in used)))

    def _indices(self, thing: bpy.types.Object, slots: np.ndarray) -> tuple[np.ndarray, list[tuple[str, str]]]:
        """(T,) indices of `shaders` for the material slots of an object's faces, and the losses of these materials.

        Slots that no face uses leave no trace.
        """
        present = [slot.material for slot in thing.material_slots] or [None]
        slots = np.clip(slots, 0, len(present) - 1)  # as in Cycles
        table, lost = np.zeros(len(present), np.int32), []
        for slot in np.flatnonzero(np.bincount(slots)):
            table[slot], notes = self._shader(present[slot])
            lost += notes
        return table[slots], lost

    def _shader(self, material: bpy.types.Material | None) -> tuple[int, tuple[tuple[str, str], ...]]:
        key = material.as_pointer() if material else 0
        if key not in self._shaders:
            shader, notes = read_material(material, self.resources)
            if fault := fault_of_shader(shader):
                raise InputError(fault)
            self._shaders[key] = len(self.shaders), tuple(notes)
            self.shaders.append(shader)
        return self._shaders[key]

    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays of `SceneData` except tables. It frees the parts of each array after joining them."""
        self._meshes.clear()
        names = self.resources.object_attributes
        meshes = self.instances.finish(self._vertices)
        table = self.instances.arrays(meshes, names)
        table["visibility"] = np.concatenate([np.array(self.visibility, np.uint8), table["visibility"]])
        table["object_attributes"] = np.concatenate([self.object_info.table(names), table["object_attributes"]], axis=1)
        attributes, rows = self.attributes.arrays(
            len(self.resources.corner_attributes), len(self.visibility), self.instances.count, meshes[table["instances"]]
        )
        table["meshes"] += np.int32(sum(map(len, self.triangles["object"])))
        triangles = {name: _joined(name, parts, self.instances.parts.pop(name, [])) for name, parts in self.triangles.items()}
        return triangles | table | {"attributes": attributes, "attribute_rows": rows}


def _joined(name: str, parts: list[np.ndarray], meshes: list[np.ndarray]) -> np.ndarray:
    dtype, shape = ARRAYS[name]
    parts += meshes
    whole = np.ascontiguousarray(parts[0]) if len(parts) == 1 else np.concatenate([np.empty([n or 0 for n in shape], dtype), *parts])
    parts.clear()
    return whole
