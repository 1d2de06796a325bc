"""Triangles: reads a mesh in its own space, and places it in the world for an instance."""

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import bpy
import numpy as np

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.faults import without_area

# Errors of Blender and numpy on an object's faulty data.
UNREADABLE = (InputError, ArithmeticError, LookupError, RuntimeError, TypeError, ValueError)
_FAR = 1e18
_BLOCK = 1 << 16  # so many triangles at a time fit into the processor's cache


@dataclass(frozen=True)
class Mesh:
    """A mesh in its own space, as Blender keeps it."""

    vertices: np.ndarray  # (V, 3) float32
    corners: np.ndarray  # (T, 3) int32, indices of vertices
    normals: np.ndarray  # (N, 3) float32: of vertices, faces or corners of faces, see `_normals`
    normal: np.ndarray  # (T, 3) int32, indices of normals
    slots: np.ndarray  # (T,) int32, material index of the face


_EMPTY = Mesh(*(np.zeros((0, 3), dtype) for dtype in (np.float32, np.int32, np.float32, np.int32)), slots=np.zeros(0, np.int32))


@dataclass(frozen=True)
class Triangles:
    """One instance in the world; every triangle has area."""

    vertices: np.ndarray  # (V, 3) float32
    corners: np.ndarray  # (T, 3) int32, indices of vertices
    normals: np.ndarray  # (T, 3, 3) float32, unit length
    slots: np.ndarray  # (T,) int32, material index of the face
    kept: np.ndarray | None  # (M,) bool, True for each of the mesh's triangles that is in `corners` (it has area); None means all
    mirrored: bool  # whether the corners of each triangle are in reverse order


@contextmanager
def evaluated_mesh(thing: bpy.types.Object) -> Iterator[bpy.types.Mesh]:
    """The mesh of an evaluated object. In edit mode this mesh is empty, so a copy is used, as in Cycles."""
    if not thing.data.is_editmode:
        yield thing.data
        return
    try:
        yield thing.to_mesh()
    finally:
        thing.to_mesh_clear()


def read_mesh(mesh: bpy.types.Mesh) -> Mesh:
    """A mesh in its own space; empty without faces. InputError if a vertex is not finite, or areas overflow."""
    if not len(mesh.polygons):
        return _EMPTY
    vertices = read_array(mesh.attributes["position"].data, "vector", (3,), np.float32)
    if not (usable := np.abs(vertices) < _FAR).all():
        vertex = usable.all(axis=1).argmin()
        raise InputError(f"vertex {vertex} is out of range: ({', '.join(f'{x:g}' for x in vertices[vertex])})")
    loops, faces = loop_triangles(mesh), triangle_faces(mesh)
    corners = corner_vertices(mesh)[loops]
    normals, normal = _normals(mesh, corners, faces, loops)
    slots = mesh.attributes.get("material_index")
    slots = read_array(slots.data, "value", (), np.int32)[faces] if slots else np.zeros(len(faces), np.int32)
    return _without_loose(Mesh(vertices, corners, normals, normal, slots))


def read_array(collection: bpy.types.bpy_prop_collection, attribute: str, shape: tuple[int, ...], dtype: type) -> np.ndarray:
    """(N, *shape): one attribute of all members of a collection."""
    values = np.empty((len(collection), *shape), dtype)
    collection.foreach_get(attribute, values.ravel())
    return values


def corner_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """(C,) int32, the vertex of each corner of a face."""
    return read_array(mesh.attributes[".corner_vert"].data, "value", (), np.int32)


def triangle_faces(mesh: bpy.types.Mesh) -> np.ndarray:
    """(T,) int32, the face of each triangle."""
    return read_array(mesh.loop_triangle_polygons, "value", (), np.int32)


def loop_triangles(mesh: bpy.types.Mesh) -> np.ndarray:
    """(T, 3) int32, the corners of faces at the corners of triangles.

    Read from Blender's own array, because `foreach_get` reads the values one by one; this would take longer than the rest of the export.
    """
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if not count:
        return np.empty((0, 3), np.int32)
    first, last = (mesh.loop_triangles[i].as_pointer() for i in (0, count - 1))
    assert last - first == 12 * (count - 1), "Blender no longer keeps its triangles as triples of 32-bit integers"
    return np.frombuffer(ctypes.string_at(first, 12 * count), np.int32).reshape(count, 3)


def _normals(mesh: bpy.types.Mesh, corners: np.ndarray, faces: np.ndarray, loops: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The smallest array of normals for flat, smooth, sharp and custom shading, and the index of each corner's normal, (T, 3)."""
    if mesh.normals_domain == "POINT":
        return read_array(mesh.vertex_normals, "vector", (3,), np.float32), corners
    if mesh.normals_domain == "FACE":
        return read_array(mesh.polygon_normals, "vector", (3,), np.float32), np.repeat(faces[:, None], 3, axis=1)
    return read_array(mesh.corner_normals, "vector", (3,), np.float32), loops


def _without_loose(mesh: Mesh) -> Mesh:
    """A mesh without its unused vertices, because these would enlarge the scene's bounds."""
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.corners] = True
    if used.all():
        return mesh
    corners = (np.cumsum(used, dtype=np.int32) - 1)[mesh.corners]
    return replace(mesh, vertices=mesh.vertices[used], corners=corners)


def place(mesh: Mesh, matrix: np.ndarray) -> Triangles:
    """A mesh, transformed to the world by `matrix`, (4, 4), see `check_transform`. If it mirrors, the winding is reversed to match the
    normals.
    """
    cofactors, mirrored = _cofactors(matrix[:3, :3])
    vertices, normals = apply(matrix[:3, :3], mesh.vertices, matrix[:3, 3]), unit(apply(cofactors, mesh.normals))
    flat = without_area(vertices, mesh.corners)
    kept = ~flat if flat.any() else None
    corners, normal, slots = (arranged(values, kept, mirrored) for values in (mesh.corners, mesh.normal, mesh.slots))
    shading = normals.take(normal, axis=0)  # several times as fast as normals[normal]
    if (missing := (normals == 0).all(axis=1)).any():
        _fill(shading, missing[normal], vertices, corners)
    return Triangles(vertices, corners, shading, slots, kept, mirrored)


def check_transform(matrix: np.ndarray) -> None:
    """InputError if a number of a matrix is not finite, or too large."""
    if np.abs(matrix).max() <= _FAR:
        return
    raise InputError(f"its transform is {'out of range' if np.isfinite(matrix).all() else 'not finite'}")


def arranged(values: np.ndarray, kept: np.ndarray | None, mirrored: bool) -> np.ndarray:
    """Values of a mesh's triangles, (T,), or of their corners, (T, 3, ...), as `Triangles` has them."""
    if kept is not None:
        values = values[kept]
    return values[:, ::-1] if mirrored and values.ndim > 1 else values


def _cofactors(linear: np.ndarray) -> tuple[np.ndarray, bool]:
    """The matrix for normals, and whether `linear` mirrors.

    It is the inverse transpose up to a positive factor, and is defined even where a scale is zero.
    """
    linear = linear / max(np.abs(linear).max(), 1e-30)
    a, b, c = linear
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
    mirrors = bool(a @ cofactors[0] < 0)
    return (-cofactors if mirrors else cofactors), mirrors


def _blocks(count: int) -> Iterator[slice]:
    return (slice(start, start + _BLOCK) for start in range(0, count, _BLOCK))


def apply(matrix: np.ndarray, points: np.ndarray, shift: np.ndarray | tuple[float, ...] = (0.0, 0.0, 0.0)) -> np.ndarray:
    """Points (N, 3) times a (3, 3) matrix plus a shift, in float32.

    Written without `@`: the rounding of `@` differs between builds of numpy, so the scene's key would differ, too.
    """
    result = np.empty(points.shape, np.float32)
    for block in _blocks(len(points)):
        x, y, z = points[block].T.astype(np.float64)
        for i, row in enumerate(matrix):
            result[block, i] = x * row[0] + y * row[1] + z * row[2] + shift[i]
    return result


def unit(vectors: np.ndarray) -> np.ndarray:
    """(N, 3) vectors of length 1; zeros if the length is zero or not finite."""
    result = np.empty(vectors.shape, np.float32)
    for block in _blocks(len(vectors)):
        x, y, z = vectors[block].T.astype(np.float64)
        length = np.sqrt(x * x + y * y + z * z)
        result[block] = (np.stack([x, y, z]) / np.where(length > 0, length, np.inf)).T
        result[block][~np.isfinite(length)] = 0.0
    return result


def _fill(normals: np.ndarray, missing: np.ndarray, vertices: np.ndarray, corners: np.ndarray) -> None:
    """Set the normals of corners that are `missing`, (T, 3), to those of their triangles."""
    rows = np.flatnonzero(missing.any(axis=1))
    a, b, c = (vertices[corners[rows, i]].astype(np.float64) for i in range(3))
    normals[rows] = np.where(missing[rows][..., None], unit(np.cross(b - a, c - a))[:, None, :], normals[rows])
