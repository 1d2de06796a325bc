"""Triangles: rays against them by Embree, called from inside the kernels, and the surface at a hit.

embreex offers batches of rays only and no masks, so its Embree 4 is called directly; see docs/decisions/0006.
"""

import ctypes
import weakref
from itertools import pairwise
from typing import NamedTuple

import embreex.rtcore_scene
import llvmlite.binding
import numpy as np
from numba import types

from ..kernels import kernel, part
from ..sampling import F, add, cross, dot, normalize, scale, subtract, vector
from .data import SceneData
from .ray_kinds import MESHES, seen_by

_TRIANGLE_GEOMETRY, _INDEX_BUFFER, _VERTEX_BUFFER, _UINT3, _FLOAT3 = 0, 0, 1, 0x5003, 0x9003  # of Embree's enumerations
_BUILD_QUALITY_HIGH = 2
RAY_WORDS = 24  # of 4 bytes, of an RTCRayHit with its padding
# Where its members are: the ray's origin and tnear, direction and time, tfar, mask, id, flags; the hit's normal, u, v, triangle,
# geometry, instance.
NEAR, DIRECTION, FAR, MASK, FLAGS, NORMAL, U, V, TRIANGLE, GEOMETRY, INSTANCE = 3, 4, 8, 9, 11, 12, 15, 16, 17, 18, 19

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
    vertices: np.ndarray  # (V, 3) float32
    triangles: np.ndarray  # (T, 3) int32
    normal: np.ndarray  # (T, 3, 3) float32, unit shading normal at each corner
    smooth: np.ndarray  # (T,) bool, whether any of these is not the triangle's own
    material: np.ndarray  # (T,) int32
    object: np.ndarray  # (T,) int32


class Geometry:
    """The scene's triangles in Embree; they live as long as this does. Any number of threads may cast rays at once."""

    def __init__(self, scene: SceneData) -> None:
        self._scene = scene  # Embree reads its triangles where they are
        self._vertices = np.append(scene.vertices.ravel(), F(0))  # Embree reads 16 bytes of the last vertex, too
        device = _library.rtcNewDevice(None)
        handle = _library.rtcNewScene(device)
        weakref.finalize(self, _release, handle, device)
        first = self._attach(device, handle)
        _library.rtcSetSceneBuildQuality(handle, _BUILD_QUALITY_HIGH)
        _library.rtcCommitScene(handle)
        if error := _library.rtcGetDeviceError(device):
            raise MemoryError(f"Embree cannot hold {len(scene.triangles)} triangles: error {error}")
        smooth = np.empty(len(scene.triangles), bool)
        find_smooth(scene.vertices, scene.triangles, scene.normals, smooth)
        self.surface = Surface(handle, first, scene.vertices, scene.triangles, scene.normals, smooth, scene.material, scene.object)

    def _attach(self, device: int, handle: int) -> np.ndarray:
        """One geometry for each run of triangles that the same kinds of rays see; returns their first triangles."""
        scene = self._scene
        seen = seen_by(scene.visibility, MESHES)[scene.object]
        starts = np.flatnonzero(np.diff(seen, prepend=-1)).astype(np.int32)
        for start, end in pairwise([*starts, len(seen)]):
            geometry = _library.rtcNewGeometry(device, _TRIANGLE_GEOMETRY)
            corners, count = scene.triangles[start:end].ctypes.data, int(end - start)
            _library.rtcSetSharedGeometryBuffer(geometry, _INDEX_BUFFER, 0, _UINT3, corners, 0, 12, count)
            _library.rtcSetSharedGeometryBuffer(
                geometry, _VERTEX_BUFFER, 0, _FLOAT3, self._vertices.ctypes.data, 0, 12, len(scene.vertices)
            )
            _library.rtcSetGeometryMask(geometry, int(seen[start]))
            _library.rtcCommitGeometry(geometry)
            _library.rtcAttachGeometry(handle, geometry)
            _library.rtcReleaseGeometry(geometry)
        return starts


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

    `rays` then has distance (FAR), barycentrics (U, V), and the triangle's normal by winding, not unit (NORMAL).
    """
    _prepare(rays, origin, direction, near, far, kind)
    rays.words[GEOMETRY] = -1
    rays.words[INSTANCE] = -1
    _intersect(surface.embree, rays.floats.ctypes.data, 0)
    geometry = rays.words[GEOMETRY]
    return surface.first[geometry] + rays.words[TRIANGLE] if geometry >= 0 else np.int32(-1)


@part
def occluded(surface, rays, origin, direction, far, kind):
    """Whether anything visible to this kind of rays stands within `far`."""
    _prepare(rays, origin, direction, F(0), far, kind)
    _occluded(surface.embree, rays.floats.ctypes.data, 0)
    return rays.floats[FAR] < F(0)


@part
def shading_normal(surface, triangle, u, v, face_normal):
    """The interpolated unit normal at barycentrics u, v; the face's own where it is flat, and where the corners' normals cancel."""
    if not surface.smooth[triangle]:
        return face_normal
    n = surface.normal[triangle]
    a, b, c = (n[0, 0], n[0, 1], n[0, 2]), (n[1, 0], n[1, 1], n[1, 2]), (n[2, 0], n[2, 1], n[2, 2])
    between = add(add(scale(a, F(1) - u - v), scale(b, u)), scale(c, v))
    return normalize(between) if dot(between, between) > F(1e-8) else face_normal


@part
def facing(surface, rays, triangle, ray):
    """Unit shading and geometric normal of the hit in `rays`, on the side that the ray comes from; and whether that is behind."""
    ng = normalize((rays.floats[NORMAL], rays.floats[NORMAL + 1], rays.floats[NORMAL + 2]))
    n = shading_normal(surface, triangle, rays.floats[U], rays.floats[V], ng)
    if dot(ng, ray) <= F(0):
        return n, ng, False
    return scale(n, F(-1)), scale(ng, F(-1)), True


@part
def off_surface(point, side, distance):
    """Move a hit point along the unit vector `side`, by more than the rounding error of a hit at that distance."""
    size = max(max(abs(point[0]), abs(point[1])), max(abs(point[2]), distance))
    return add(point, scale(side, F(3e-5) * size))
