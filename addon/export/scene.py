"""Puts the bundle together from what the other files of this folder read."""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import bpy
import numpy as np

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import ARRAYS, SceneData, emits, find_fault
from blender_rl_guiding.scene.description import Lamp, Loss, Shader

from . import coverage
from .attributes import Attributes, Placed, depends_on_place
from .camera import read_camera
from .film import read_bounces, read_film
from .geometry import Mesh, Triangles, place, read_mesh
from .instances import Instances, Kind, Use, fits, kind_of, use_of, worth_instancing
from .lamps import read_lamp
from .materials import read_material
from .object_info import ObjectInfo
from .resources import Resources, corner_attributes_of
from .visibility import visibility
from .world import read_world, world_visibility


class Collector:
    """Grows the scene instance by instance; each mesh and each material is read once.

    Meshes of the uses in `repeated` are kept once where they can be, all others are placed in the world each time.
    """

    def __init__(self, depsgraph: bpy.types.Depsgraph, repeated: frozenset[Use]) -> None:
        self.triangles: dict[str, list[np.ndarray]] = {"vertices": [], "triangles": [], "normals": [], "material": [], "object": []}
        self.visibility: list[int] = []
        self.object_info = ObjectInfo()
        self.instances = Instances()
        self.shaders: list[Shader] = []
        self.lamps: list[Lamp] = []
        self.losses: dict[Loss, None] = {}  # an ordered set
        self.resources = Resources()
        self.attributes = Attributes()
        self._depsgraph = depsgraph
        self._repeated = repeated
        self._vertices = 0
        self._meshes: dict[int, Mesh] = {}
        self._seen: dict[Kind, int] = {}
        self._noted: set[tuple[Kind, bool, bool]] = set()
        self._uses: dict[Kind, Use] = {}
        self._kept_once: dict[Use, int | None] = {}  # number of the mesh; None where it cannot be
        self._tangents: dict[tuple[int, str], tuple[np.ndarray, np.ndarray]] = {}
        self._shaders: dict[int, tuple[int, tuple[tuple[str, str], ...]]] = {}

    def note(self, losses: Iterable[Loss]) -> None:
        """Lines for the coverage report."""
        self.losses.update(dict.fromkeys(losses))

    def note_kind(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """What is lost of an instance, its materials aside; nothing if one like it has been here."""
        kind = kind_of(instance), instance.show_self, instance.show_particles
        if kind not in self._noted:
            self._noted.add(kind)
            self.note(coverage.of_instance(instance, self._depsgraph.view_layer))

    def add(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """Take one instance, if it is a lamp or a mesh that any rays can see."""
        thing, matrix = instance.object, np.array(instance.matrix_world, np.float64)
        kind = kind_of(instance)
        if kind not in self._seen:
            self._seen[kind] = visibility(instance, self._depsgraph.view_layer)
        seen = self._seen[kind]
        if thing.type == "LIGHT":
            lamp, losses = read_lamp(thing, matrix, seen)
            self.lamps += [lamp] if lamp else []
            self.note(losses)
        elif isinstance(thing.data, bpy.types.Mesh) and seen:
            self._add_mesh(instance, kind, matrix, seen)

    def _add_mesh(self, instance: bpy.types.DepsgraphObjectInstance, kind: Kind, matrix: np.ndarray, seen: int) -> None:
        thing = instance.object
        mesh = self._kept(kind, thing) if fits(instance.matrix_world) else None
        if mesh is not None:
            notes = self.instances.add(mesh, matrix, seen)
            self.instances.object_info.add(self.resources.object_attributes, instance)
            if notes:
                self.note(Loss(thing.name, where, detail) for where, detail in notes)
            return
        part = self._placed(thing, matrix)
        if len(part.corners):
            material, notes = self._indices(thing, part.slots)
            self.note(Loss(thing.name, where, detail) for where, detail in notes)
            self._add_triangles(part, material)
            self._add_attributes(len(self.visibility), thing, material, part, matrix)
            self.object_info.add(self.resources.object_attributes, instance)
            self.visibility.append(seen)

    def _placed(self, thing: bpy.types.Object, matrix: np.ndarray) -> Triangles:
        # The evaluated mesh lives as long as the depsgraph, so its address identifies it.
        key = thing.data.as_pointer()
        if key not in self._meshes:
            self._meshes[key] = read_mesh(thing)
        part = place(self._meshes[key], matrix, thing.name)
        if part.kept is not None:
            self.note([Loss(thing.name, "mesh", f"{(~part.kept).sum()} triangle(s) without area are left out")])
        return part

    def _kept(self, kind: Kind, thing: bpy.types.Object) -> int | None:
        """The number of the mesh that all instances like this share; None where each has its own triangles."""
        if kind not in self._uses:
            self._uses[kind] = use_of(thing)
        use = self._uses[kind]
        if use in self._repeated and use not in self._kept_once:
            self._kept_once[use] = self._add_repeated(thing)
        return self._kept_once.get(use)

    def _add_repeated(self, thing: bpy.types.Object) -> int | None:
        """Take a mesh once. None if it has no triangles, if they emit and have to be sampled, or if attributes depend on the place."""
        part = self._placed(thing, np.eye(4))
        material, notes = self._indices(thing, part.slots)
        shines = any(emits(closure) for index in np.unique(material) for closure in self.shaders[index].closures)
        local = not any(depends_on_place(self.resources.corner_attributes[number]) for number in self._corner_attributes(material))
        if shines or not local or not len(part.corners):
            return None
        mesh = self.instances.count
        self.instances.add_mesh(part, material, notes)
        self._add_attributes(~mesh, thing, material, part, np.eye(4))
        return mesh

    def _add_triangles(self, part: Triangles, material: np.ndarray) -> None:
        own = np.full(len(material), len(self.visibility), np.int32)
        arrays = (part.vertices, part.corners + np.int32(self._vertices), part.normals, material, own)
        for parts, array in zip(self.triangles.values(), arrays, strict=True):
            parts.append(array)
        self._vertices += len(part.vertices)

    def _add_attributes(self, owner: int, thing: bpy.types.Object, material: np.ndarray, part: Triangles, matrix: np.ndarray) -> None:
        """The attributes that the materials read, of an object, or of the mesh ~owner."""
        placed = Placed(thing.data, self._meshes[thing.data.as_pointer()], part, matrix, self._depsgraph, self._tangents)
        for number in self._corner_attributes(material):
            self.attributes.add(number, self.resources.corner_attributes[number], owner, placed)

    def _corner_attributes(self, material: np.ndarray) -> list[int]:
        used = np.flatnonzero(np.bincount(material))
        return sorted(set().union(*(corner_attributes_of(self.shaders[index]) for index in used)))

    def _indices(self, thing: bpy.types.Object, slots: np.ndarray) -> tuple[np.ndarray, list[tuple[str, str]]]:
        """(T,) indices of `shaders` for the material slots of an object's faces, and what of these is lost.

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
            self._shaders[key] = len(self.shaders), tuple(notes)
            self.shaders.append(shader)
        return self._shaders[key]

    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays of `SceneData`, all but tables. What they are made from is let go of, array by array."""
        self._meshes.clear()
        names = self.resources.object_attributes
        table = self.instances.arrays(names)
        table["visibility"] = np.concatenate([np.array(self.visibility, np.uint8), table["visibility"]])
        table["object_attributes"] = np.concatenate([self.object_info.table(names), table["object_attributes"]], axis=1)
        attributes, rows = self.attributes.arrays(
            len(self.resources.corner_attributes), len(self.visibility), len(table["meshes"]), table["instances"]
        )
        table["meshes"] += np.int32(sum(map(len, self.triangles["object"])))
        for corners in self.instances.parts["triangles"]:
            corners += np.int32(self._vertices)
        triangles = {name: _joined(name, parts, self.instances.parts.pop(name, [])) for name, parts in self.triangles.items()}
        return triangles | table | {"attributes": attributes, "attribute_rows": rows}


class Stopped(Exception):  # noqa: N818  # it is no error
    """The user has enough."""


def export(depsgraph: bpy.types.Depsgraph, stop: Callable[[], bool] = lambda: False) -> SceneData:
    """The scene of a depsgraph in render mode. InputError names what makes it impossible to render.

    `stop` is asked before each instance; Stopped where it says yes.
    """
    scene = depsgraph.scene
    name = Path(bpy.data.filepath).name or scene.name
    try:
        data = _export(depsgraph, Path(name).stem, stop)
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
    if fault := find_fault(data):
        raise InputError(f"{name}: {fault}")
    return data


def _export(depsgraph: bpy.types.Depsgraph, name: str, stop: Callable[[], bool]) -> SceneData:
    scene, collector = depsgraph.scene, Collector(depsgraph, worth_instancing(_instances(depsgraph, stop)))
    camera, camera_losses = read_camera(depsgraph)
    world, world_losses = read_world(scene.world, collector.resources)
    for instance in _instances(depsgraph, stop):
        collector.note_kind(instance)
        if instance.show_self:
            collector.add(instance)
    return SceneData(
        name=name,
        **collector.arrays(),
        shaders=tuple(collector.shaders),
        camera=camera,
        world=world,
        world_visibility=world_visibility(scene.world),
        lamps=tuple(collector.lamps),
        film=read_film(scene),
        bounces=read_bounces(scene),
        tables=collector.resources.tables,
        textures=tuple(collector.resources.textures),
        coverage=(*coverage.of_scene(scene, depsgraph.view_layer), *camera_losses, *world_losses, *collector.losses),
    )


def _instances(depsgraph: bpy.types.Depsgraph, stop: Callable[[], bool]) -> Iterator[bpy.types.DepsgraphObjectInstance]:
    for instance in depsgraph.object_instances:
        if stop():
            raise Stopped
        yield instance


def _joined(name: str, parts: list[np.ndarray], meshes: list[np.ndarray]) -> np.ndarray:
    dtype, shape = ARRAYS[name]
    parts += meshes
    whole = np.ascontiguousarray(parts[0]) if len(parts) == 1 else np.concatenate([np.empty([n or 0 for n in shape], dtype), *parts])
    parts.clear()
    return whole
