"""Triangles: rays against them by Embree, called from inside the kernels, and the surface at a hit.

embreex offers batches of rays only and no masks, so its Embree 4 is called directly; see docs/decisions/0006.
"""

import ctypes
import weakref
from typing import NamedTuple

import embreex.rtcore_scene
import llvmlite.binding
import numpy as np
from numba import types

from ..kernels import kernel, part
from ..sampling import F, add, cross, dot, normalize, scale, subtract, vector
from .data import SceneData
from .instances import runs
from .placing import normal_to_world, point_to_world
from .ray_kinds import MESHES, seen_by

_TRIANGLE_GEOMETRY, _INDEX_BUFFER, _VERTEX_BUFFER, _UINT3, _FLOAT3 = 0, 0, 1, 0x5003, 0x9003  # of Embree's enumerations
_INSTANCE_ARRAY, _TRANSFORM_BUFFER, _FLOAT3X4_ROW_MAJOR = 122, 23, 0x9134
_BUILD_QUALITY_HIGH = 2
_EVERY_RAY = 0xFFFFFFFF
RAY_WORDS = 24  # of 4 bytes, of an RTCRayHit with its padding
# Where its members are: the ray's origin and tnear, direction and time, tfar, mask, id, flags; the hit's normal, u, v, triangle,
# geometry, array of instances, place in it.
NEAR, DIRECTION, FAR, MASK, FLAGS, NORMAL, U, V, TRIANGLE, GEOMETRY, INSTANCES, PLACE = 3, 4, 8, 9, 11, 12, 15, 16, 17, 18, 19, 20

_pointer, _size = ctypes.c_void_p, ctypes.c_size_t
_library = ctypes.CDLL(embreex.rtcore_scene.__file__)  # finds the symbols of the Embree that it is linked to, too
_SIGNATURES = {
    "rtcNewDevice": (_pointer, (ctypes.c_char_p,)),
    "rtcGetDeviceError": (ctypes.c_int, (_pointer,)),
    "rtcReleaseDevice": (None, (_pointer,)),
    "rtcNewScene": (_pointer, (_pointer,)),
    "rtcSetSceneBuildQuality": (None, (_pointer, ctypes.c_int)),
    "rtcCommitScene": (None, (_pointer,)),
    "rtcReleaseScene": (None, (_pointer,)),
    "rtcNewGeometry": (_pointer, (_pointer, ctypes.c_int)),
    "rtcSetSharedGeometryBuffer": (None, (_pointer, ctypes.c_int, ctypes.c_uint, ctypes.c_int, _pointer, _size, _size, _size)),
    "rtcSetGeometryInstancedScene": (None, (_pointer, _pointer)),
    "rtcSetGeometryMask": (None, (_pointer, ctypes.c_uint)),
    "rtcCommitGeometry": (None, (_pointer,)),
    "rtcAttachGeometry": (ctypes.c_uint, (_pointer, _pointer)),
    "rtcReleaseGeometry": (None, (_pointer,)),
}
for _name, (_result, _arguments) in _SIGNATURES.items():
    getattr(_library, _name).restype, getattr(_library, _name).argtypes = _result, _arguments
for _name in ("rtcIntersect1", "rtcOccluded1"):
    llvmlite.binding.add_symbol(_name, ctypes.cast(getattr(_library, _name), _pointer).value)
_query = types.void(types.intp, types.intp, types.intp)
_intersect = types.ExternalFunction("rtcIntersect1", _query)
_occluded = types.ExternalFunction("rtcOccluded1", _query)


class Rays(NamedTuple):
    """What a thread needs to cast rays: one RTCRayHit, seen as numbers of either kind."""

    floats: np.ndarray  # (24,) float32, aligned to 16 bytes
    words: np.ndarray  # (24,) int32, the same memory


class Surface(NamedTuple):
    """What the kernels know of the triangles."""

    embree: int  # address of the RTCScene
    first: np.ndarray  # (G,) int32, first triangle of each of Embree's geometries
    first_object: np.ndarray  # (G,) int32, object of the first instance of each of them that is an array of instances
    placed: int  # the objects from here on are instances
    to_world: np.ndarray  # (I, 3, 4) float32, of these
    vertices: np.ndarray  # (V, 3) float32
    triangles: np.ndarray  # (T, 3) int32
    normal: np.ndarray  # (T, 3, 3) float32, unit shading normal at each corner
    smooth: np.ndarray  # (T,) bool, whether any of these is not the triangle's own
    material: np.ndarray  # (T,) int32
    object: np.ndarray  # (W,) int32, of the triangles in world space


class Geometry:
    """The scene's triangles in Embree; they live as long as this does. Any number of threads may cast rays at once."""

    def __init__(self, scene: SceneData) -> None:
        self._scene = scene  # Embree reads its triangles where they are
        self._vertices = np.append(scene.vertices.ravel(), F(0))  # Embree reads 16 bytes of the last vertex, too
        device = _library.rtcNewDevice(None)
        handle = _library.rtcNewScene(device)
        weakref.finalize(self, _release, handle, device)
        first = self._attach_triangles(device, handle)
        meshes, first_object = self._attach_instances(device, handle)
        _commit(handle)
        if error := _library.rtcGetDeviceError(device):
            raise MemoryError(f"Embree cannot hold {len(scene.triangles)} triangles and {len(scene.instances)} instances: error {error}")
        smooth = np.empty(len(scene.triangles), bool)
        find_smooth(scene.vertices, scene.triangles, scene.normals, smooth)
        self.surface = Surface(
            handle,
            np.array(first + meshes, np.int32),
            np.array([0] * len(first) + first_object, np.int32),
            scene.placed,
            scene.instance_to_world,
            scene.vertices,
            scene.triangles,
            scene.normals,
            smooth,
            scene.material,
            scene.object,
        )

    def _attach_triangles(self, device: int, handle: int) -> list[int]:
        """One geometry for each run of triangles that the same kinds of rays see; returns their first triangles."""
        seen = seen_by(self._scene.visibility, MESHES)[self._scene.object]
        found = list(runs(seen))
        for start, end in found:
            _attach(handle, self._triangles(device, start, end), int(seen[start]))
        return [start for start, _ in found]

    def _attach_instances(self, device: int, handle: int) -> tuple[list[int], list[int]]:
        """One geometry for each run of instances of a mesh that the same kinds of rays see.

        Returns the first triangles of their meshes, and the objects of their first instances.
        """
        scene = self._scene
        seen = seen_by(scene.visibility, MESHES)[scene.placed :]
        found = list(runs(scene.instances.astype(np.int64) << 32 | seen))
        meshes = {mesh: self._mesh(device, mesh) for mesh in {int(scene.instances[start]) for start, _ in found}}
        for start, end in found:
            geometry = _library.rtcNewGeometry(device, _INSTANCE_ARRAY)
            _library.rtcSetGeometryInstancedScene(geometry, meshes[int(scene.instances[start])])
            matrices = scene.instance_to_world[start:end].ctypes.data
            _library.rtcSetSharedGeometryBuffer(geometry, _TRANSFORM_BUFFER, 0, _FLOAT3X4_ROW_MAJOR, matrices, 0, 48, end - start)
            _attach(handle, geometry, int(seen[start]))
        for mesh in meshes.values():
            _library.rtcReleaseScene(mesh)  # the instances hold it
        return [int(scene.meshes[scene.instances[start]]) for start, _ in found], [scene.placed + start for start, _ in found]

    def _mesh(self, device: int, mesh: int) -> int:
        """An RTCScene of one mesh in its own space; its instances know who sees it."""
        ends = [*self._scene.meshes[1:].tolist(), len(self._scene.triangles)]
        handle = _library.rtcNewScene(device)
        _attach(handle, self._triangles(device, int(self._scene.meshes[mesh]), ends[mesh]), _EVERY_RAY)
        _commit(handle)
        return handle

    def _triangles(self, device: int, start: int, end: int) -> int:
        geometry = _library.rtcNewGeometry(device, _TRIANGLE_GEOMETRY)
        corners, vertices = self._scene.triangles[start:end].ctypes.data, self._vertices.ctypes.data
        _library.rtcSetSharedGeometryBuffer(geometry, _INDEX_BUFFER, 0, _UINT3, corners, 0, 12, end - start)
        _library.rtcSetSharedGeometryBuffer(geometry, _VERTEX_BUFFER, 0, _FLOAT3, vertices, 0, 12, len(self._scene.vertices))
        return geometry


def _attach(scene: int, geometry: int, seen: int) -> None:
    """Give a geometry to a scene, for rays of these kinds."""
    _library.rtcSetGeometryMask(geometry, seen)
    _library.rtcCommitGeometry(geometry)
    _library.rtcAttachGeometry(scene, geometry)
    _library.rtcReleaseGeometry(geometry)


def _commit(scene: int) -> None:
    _library.rtcSetSceneBuildQuality(scene, _BUILD_QUALITY_HIGH)
    _library.rtcCommitScene(scene)


def _release(scene: int, device: int) -> None:
    _library.rtcReleaseScene(scene)
    _library.rtcReleaseDevice(device)


@kernel
def find_smooth(vertices, triangles, normals, smooth):
    """Write which triangles have shading normals of their own, by more than rounding."""
    for i in range(triangles.shape[0]):
        p, n = triangles[i], normals[i]
        a = vector(vertices, p[0])
        own = normalize(cross(subtract(vector(vertices, p[1]), a), subtract(vector(vertices, p[2]), a)))
        smooth[i] = _differ(own, vector(n, 0)) or _differ(own, vector(n, 1)) or _differ(own, vector(n, 2))


@part
def _differ(a, b):
    d = subtract(a, b)
    return dot(d, d) > F(1e-10)


def rays() -> Rays:
    """Memory for one thread's rays."""
    memory = np.zeros(RAY_WORDS + 4, np.float32)
    floats = memory[-memory.ctypes.data % 16 // 4 :][:RAY_WORDS]
    return Rays(floats, floats.view(np.int32))


@part
def _prepare(rays, origin, direction, near, far, kind):
    for axis in range(3):
        rays.floats[axis] = origin[axis]
        rays.floats[DIRECTION + axis] = direction[axis]
    rays.floats[NEAR] = near
    rays.floats[FAR] = far
    rays.words[MASK] = kind
    rays.words[FLAGS] = 0


@part
def closest(surface, rays, origin, direction, near, far, kind):
    """The first triangle along a ray that is visible to this kind of rays: its index or -1.

    `rays` then has distance (FAR), barycentrics (U, V), and the triangle's normal by winding, not unit, in its own space (NORMAL).
    """
    _prepare(rays, origin, direction, near, far, kind)
    rays.words[GEOMETRY] = -1
    rays.words[INSTANCES] = -1
    _intersect(surface.embree, rays.floats.ctypes.data, 0)
    geometry = max(rays.words[GEOMETRY], rays.words[INSTANCES])  # a mesh of instances is the only geometry of its scene: number 0
    return surface.first[geometry] + rays.words[TRIANGLE] if geometry >= 0 else np.int32(-1)


@part
def object_hit(surface, rays, triangle):
    """The object that the hit in `rays`, on this triangle, belongs to."""
    instances = rays.words[INSTANCES]
    return surface.object[triangle] if instances < 0 else np.int32(surface.first_object[instances] + rays.words[PLACE])


@part
def occluded(surface, rays, origin, direction, far, kind):
    """Whether anything visible to this kind of rays stands within `far`."""
    _prepare(rays, origin, direction, F(0), far, kind)
    _occluded(surface.embree, rays.floats.ctypes.data, 0)
    return rays.floats[FAR] < F(0)


@part
def shading_normal(surface, triangle, u, v, face_normal):
    """The interpolated unit normal at barycentrics u, v; the face's own where it is flat, and where the corners' normals cancel.

    All of them are in the space of the triangle.
    """
    if not surface.smooth[triangle]:
        return face_normal
    n = surface.normal[triangle]
    a, b, c = (n[0, 0], n[0, 1], n[0, 2]), (n[1, 0], n[1, 1], n[1, 2]), (n[2, 0], n[2, 1], n[2, 2])
    between = add(add(scale(a, F(1) - u - v), scale(b, u)), scale(c, v))
    return normalize(between) if dot(between, between) > F(1e-8) else face_normal


@part
def facing(surface, rays, triangle, object_, ray):
    """Unit shading and geometric normal of the hit in `rays`, on the side that the ray comes from; and whether that is behind."""
    ng = normalize((rays.floats[NORMAL], rays.floats[NORMAL + 1], rays.floats[NORMAL + 2]))
    n = shading_normal(surface, triangle, rays.floats[U], rays.floats[V], ng)
    if object_ >= surface.placed:
        i = object_ - surface.placed
        n, ng = normal_to_world(surface.to_world, i, n), normal_to_world(surface.to_world, i, ng)
    if dot(ng, ray) <= F(0):
        return n, ng, False
    return scale(n, F(-1)), scale(ng, F(-1)), True


@part
def corners_of(surface, triangle, object_):
    """The corners of a triangle of an object, and the shading normals there, in the world."""
    corners, normals = surface.triangles[triangle], surface.normal[triangle]
    a, b, c = vector(surface.vertices, corners[0]), vector(surface.vertices, corners[1]), vector(surface.vertices, corners[2])
    n_a, n_b, n_c = vector(normals, 0), vector(normals, 1), vector(normals, 2)
    if object_ >= surface.placed:
        i, m = object_ - surface.placed, surface.to_world
        a, b, c = point_to_world(m, i, a), point_to_world(m, i, b), point_to_world(m, i, c)
        n_a, n_b, n_c = normal_to_world(m, i, n_a), normal_to_world(m, i, n_b), normal_to_world(m, i, n_c)
    return a, b, c, n_a, n_b, n_c


@part
def off_surface(point, side, distance):
    """Move a hit point along the unit vector `side`, by more than the rounding error of a hit at that distance."""
    size = max(max(abs(point[0]), abs(point[1])), max(abs(point[2]), distance))
    return add(point, scale(side, F(3e-5) * size))
