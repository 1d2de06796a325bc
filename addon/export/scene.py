"""Puts the bundle together from what the other files of this folder read."""

from pathlib import Path

import bpy
import numpy as np

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import Loss, Material, SceneData, find_fault

from . import coverage
from .camera import read_camera
from .clipping import clipped
from .geometry import Mesh, Triangles, place, read_mesh
from .materials import Surface, read_material
from .world import read_world

_MAX_BOUNCES = 10  # where Blender has been built or started without Cycles


class Collector:
    """Grows the scene instance by instance; each mesh and each material is read once."""

    def __init__(self) -> None:
        self.parts: list[Triangles] = []
        self.material: list[np.ndarray] = []
        self.materials: list[Material] = []
        self.losses: dict[Loss, None] = {}  # an ordered set
        self._meshes: dict[int, Mesh] = {}
        self._surfaces: dict[int, tuple[int, Surface]] = {}

    def add(self, thing: bpy.types.Object, matrix: np.ndarray) -> None:
        """Take one instance of an object whose data is a mesh."""
        # The evaluated mesh lives as long as the depsgraph, so its address identifies it.
        key = thing.data.as_pointer()
        if key not in self._meshes:
            self._meshes[key] = read_mesh(thing)
        part = place(self._meshes[key], matrix, thing.name)
        if part.dropped:
            self.losses[Loss(thing.name, "mesh", f"{part.dropped} triangle(s) without area are left out")] = None
        if len(part.corners):
            self.parts.append(part)
            self.material.append(self._indices(thing, part.slots))

    def _indices(self, thing: bpy.types.Object, slots: np.ndarray) -> np.ndarray:
        """(T,) indices of `materials` for the material slots of an object's faces; slots that no face uses leave no trace."""
        present = _materials(thing) or [None]
        slots = np.clip(slots, 0, len(present) - 1)  # as in Cycles
        table = np.zeros(len(present), np.int32)
        for slot in np.flatnonzero(np.bincount(slots)):
            index, surface = self._surface(present[slot])
            table[slot] = index
            self.losses.update((Loss(thing.name, where, detail), None) for where, detail in surface.notes)
        return table[slots]

    def _surface(self, material: bpy.types.Material | None) -> tuple[int, Surface]:
        key = material.as_pointer() if material else 0
        if key not in self._surfaces:
            surface = read_material(material)
            self._surfaces[key] = len(self.materials), surface
            self.materials.append(surface.material)
        return self._surfaces[key]


def _materials(thing: bpy.types.Object) -> list[bpy.types.Material | None]:
    return [slot.material for slot in thing.material_slots]


def export(depsgraph: bpy.types.Depsgraph) -> SceneData:
    """The scene of a depsgraph in render mode. InputError names what makes it impossible to render."""
    scene = depsgraph.scene
    name = Path(bpy.data.filepath).name or scene.name
    try:
        data = _export(depsgraph, Path(name).stem)
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
    if fault := find_fault(data):
        raise InputError(f"{name}: {fault}{_hint(fault, data)}")
    return data


def _export(depsgraph: bpy.types.Depsgraph, name: str) -> SceneData:
    scene, collector = depsgraph.scene, Collector()
    camera, camera_losses = read_camera(depsgraph)
    world, world_losses = read_world(scene.world)
    for instance in depsgraph.object_instances:
        collector.losses.update(dict.fromkeys(coverage.of_instance(instance, depsgraph.view_layer)))
        if instance.show_self and isinstance(instance.object.data, bpy.types.Mesh):
            collector.add(instance.object, np.array(instance.matrix_world, np.float64))
    arrays = _joined(collector)
    camera_losses += clipped(scene.camera, camera, arrays["vertices"], arrays["triangles"])
    return SceneData(
        name=name,
        **arrays,
        materials=tuple(collector.materials),
        camera=camera,
        world=world,
        max_bounces=_max_bounces(scene),
        coverage=(*coverage.of_scene(scene), *camera_losses, *world_losses, *collector.losses),
    )


def _joined(collector: Collector) -> dict[str, np.ndarray]:
    parts = collector.parts
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    return {
        "vertices": np.concatenate([np.empty((0, 3), np.float32), *(part.vertices for part in parts)]),
        "triangles": np.concatenate(
            [np.empty((0, 3), np.int32), *(part.corners + np.int32(start) for part, start in zip(parts, starts, strict=False))]
        ),
        "normals": np.concatenate([np.empty((0, 3, 3), np.float32), *(part.normals for part in parts)]),
        "material": np.concatenate([np.empty(0, np.int32), *collector.material]),
    }


def _max_bounces(scene: bpy.types.Scene) -> int:
    """Scattering events: Cycles' limit of N lets a path scatter N + 1 times; a limit for diffuse bounces holds beside it."""
    if not hasattr(scene, "cycles"):
        return _MAX_BOUNCES
    return min(scene.cycles.max_bounces, scene.cycles.diffuse_bounces) + 1


def _hint(fault: str, data: SceneData) -> str:
    lamps = [loss.object for loss in data.coverage if "lamps are not supported" in loss.detail]
    return f"; its {len(lamps)} lamp(s), {lamps[0]!r} first, are not supported yet" if "no light" in fault and lamps else ""
