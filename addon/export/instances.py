"""Instances of repeated meshes: chooses the meshes to store once, and collects their instances."""

from array import array
from collections import Counter
from collections.abc import Iterable, Sequence

import bpy
import numpy as np
from mathutils import Matrix

from .geometry import Triangles
from .object_info import ObjectInfo, ObjectKey

# Up to this many triangles are copied into the world: rays hit copies faster than instances. They take 0.2 GB in all.
COPIES = 1 << 20
_COST = 2  # memory of an instance, in triangles
_THINNEST = 1e-3  # limit for min / max of the scales, and for |det| / their product: float32 cannot invert much flatter matrices
_SMALLEST, _LARGEST = 1e-7, 1e9

Kind = tuple[int, int, int]  # addresses of an object, of its data and of its instancer
Use = tuple[int, ...]  # addresses of a mesh and of the materials in the slots of an object that shows it


def kind_of(instance: bpy.types.DepsgraphObjectInstance) -> Kind:
    """A key that is equal for instances that differ only in their matrix. So one evaluation is enough for all of them."""
    thing, data = instance.object, instance.object.data
    parent = instance.parent.as_pointer() if instance.is_instance else 0
    return thing.original.as_pointer(), data.as_pointer() if data else 0, parent


def use_of(thing: bpy.types.Object) -> Use:
    """A key that is equal for two objects if they can share triangles."""
    return (thing.data.as_pointer(), *(slot.material.as_pointer() if slot.material else 0 for slot in thing.material_slots))


def worth_instancing(instances: Iterable[bpy.types.DepsgraphObjectInstance]) -> frozenset[Use]:
    """The uses to store once, those with the largest saving first, until at most `COPIES` triangles remain to be copied."""
    uses: dict[Kind, Use] = {}
    triangles: dict[Use, int] = {}
    counts: Counter[Use] = Counter()
    for instance in instances:
        thing = instance.object
        if instance.show_self and isinstance(thing.data, bpy.types.Mesh):
            kind = kind_of(instance)
            if kind not in uses:
                uses[kind] = use_of(thing)
                triangles[uses[kind]] = max(len(thing.data.loops) - 2 * len(thing.data.polygons), 0)
            counts[uses[kind]] += 1
    copies = {use: (count - 1) * triangles[use] for use, count in counts.items()}
    total, chosen = sum(copies.values()), set()
    for use in sorted(copies, key=copies.__getitem__, reverse=True):
        if total <= COPIES:
            break
        if copies[use] > _COST * counts[use]:
            chosen.add(use)
            total -= copies[use]
    return frozenset(chosen)


def fits(matrix: Matrix) -> bool:
    """Whether float32 is precise enough for rays in mesh space; `matrix`, (4, 4), transforms mesh space to world space."""
    smallest, middle, largest = sorted(map(abs, matrix.to_scale()))
    thick = smallest > _THINNEST * largest and abs(matrix.determinant()) > _THINNEST * smallest * middle * largest
    return thick and smallest > _SMALLEST and largest < _LARGEST


class Instances:
    """Collects meshes and their instances, one by one."""

    def __init__(self) -> None:
        self.parts: dict[str, list[np.ndarray]] = {"vertices": [], "triangles": [], "normals": [], "material": []}
        self.object_info = ObjectInfo()
        self._notes: list[list[tuple[str, str]]] = []
        self._mesh, self._seen, self._matrices = array("i"), array("B"), array("f")

    @property
    def count(self) -> int:
        """Meshes so far."""
        return len(self._notes)

    def add_mesh(self, part: Triangles, material: np.ndarray, notes: list[tuple[str, str]]) -> None:
        """Add a mesh, in its own space, with the losses of its materials."""
        arrays = (part.vertices, part.corners.copy(), part.normals, material)  # a copy of the corners: `finish` renumbers them
        for parts, values in zip(self.parts.values(), arrays, strict=True):
            parts.append(values)
        self._notes.append(notes)

    def add(self, mesh: int, matrix: np.ndarray, seen: int) -> list[tuple[str, str]]:
        """Add an instance of a mesh, placed by a matrix (4, 4), seen by these kinds of rays; returns the losses of its materials."""
        self._mesh.append(mesh)
        self._seen.append(seen)
        self._matrices.frombytes(matrix[:3].astype(np.float32).tobytes())
        return self._notes[mesh]

    def finish(self, vertices: int) -> np.ndarray:
        """Drop meshes without a readable instance; returns the numbers of the others, in ascending order.

        Corners then count from the scene's first vertex: `vertices` come before those of meshes.
        """
        used = np.unique(np.array(self._mesh, np.int32))
        self.parts = {name: [parts[mesh] for mesh in used] for name, parts in self.parts.items()}
        for corners, points in zip(self.parts["triangles"], self.parts["vertices"], strict=True):
            corners += np.int32(vertices)
            vertices += len(points)
        return used

    def arrays(self, used: np.ndarray, names: Sequence[ObjectKey]) -> dict[str, np.ndarray]:
        """The arrays of `SceneData` about instances, grouped by mesh and visibility. `meshes` counts from the first mesh."""
        mesh, seen = np.array(self._mesh, np.int32), np.array(self._seen, np.uint8)
        order = np.lexsort((seen, mesh))
        sizes = [len(corners) for corners in self.parts["triangles"]]
        return {
            "meshes": np.cumsum([0, *sizes], dtype=np.int32)[:-1],
            "instances": np.searchsorted(used, mesh[order]).astype(np.int32),
            "instance_to_world": np.array(self._matrices, np.float32).reshape(-1, 3, 4)[order],
            "visibility": seen[order],
            "object_attributes": self.object_info.table(names)[:, order],
        }
