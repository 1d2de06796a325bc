"""Embree 4 by its C interface: scenes of triangles, and the functions by which kernels cast rays.

The package embreex brings the library, but offers only batches of rays, without masks or instances: see docs/decisions/0006 and 0015.
"""

import ctypes

import embreex.rtcore_scene
import llvmlite.binding
import numpy as np
from numba import types

_TRIANGLE_GEOMETRY, _INDEX_BUFFER, _VERTEX_BUFFER, _UINT3, _FLOAT3 = 0, 0, 1, 0x5003, 0x9003  # values of Embree's enumerations
_INSTANCE_ARRAY, _TRANSFORM_BUFFER, _FLOAT3X4_ROW_MAJOR = 122, 23, 0x9134
_BUILD_QUALITY_HIGH = 2
_EVERY_RAY = 0xFFFFFFFF

_pointer, _size = ctypes.c_void_p, ctypes.c_size_t
_library = ctypes.CDLL(embreex.rtcore_scene.__file__)  # this library is linked to Embree, so Embree's functions are found in it
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
intersect = types.ExternalFunction("rtcIntersect1", _query)
occluded = types.ExternalFunction("rtcOccluded1", _query)


def new_device_and_scene() -> tuple[int, int]:
    """The addresses of a new RTCDevice and of an empty RTCScene."""
    device = _library.rtcNewDevice(None)
    return device, _library.rtcNewScene(device)


def release(scene: int, device: int) -> None:
    """Free the RTCScene and the RTCDevice."""
    _library.rtcReleaseScene(scene)
    _library.rtcReleaseDevice(device)


def triangles(device: int, corners: np.ndarray, numbers: np.ndarray) -> int:
    """An RTCGeometry of triangles. Embree does not copy the arrays: they must live longer than the geometry.

    corners: (T, 3) int32, indices of vertices. numbers: (3 V + 1,) float32, the vertices and one more number, because Embree reads 16
    bytes of every vertex, also of the last one.
    """
    geometry = _library.rtcNewGeometry(device, _TRIANGLE_GEOMETRY)
    _library.rtcSetSharedGeometryBuffer(geometry, _INDEX_BUFFER, 0, _UINT3, corners.ctypes.data, 0, 12, len(corners))
    _library.rtcSetSharedGeometryBuffer(geometry, _VERTEX_BUFFER, 0, _FLOAT3, numbers.ctypes.data, 0, 12, len(numbers) // 3)
    return geometry


def instances(device: int, mesh: int, matrices: np.ndarray) -> int:
    """An RTCGeometry with one instance of the RTCScene `mesh` per matrix, (I, 3, 4) float32. Embree does not copy the matrices."""
    geometry = _library.rtcNewGeometry(device, _INSTANCE_ARRAY)
    _library.rtcSetGeometryInstancedScene(geometry, mesh)
    _library.rtcSetSharedGeometryBuffer(geometry, _TRANSFORM_BUFFER, 0, _FLOAT3X4_ROW_MAJOR, matrices.ctypes.data, 0, 48, len(matrices))
    return geometry


def scene_of(device: int, geometry: int) -> int:
    """An RTCScene of one geometry, ready for rays. All rays see the scene; the masks of its instances limit this."""
    scene = _library.rtcNewScene(device)
    attach(scene, geometry, _EVERY_RAY)
    commit(scene)
    return scene


def attach(scene: int, geometry: int, seen: int) -> None:
    """Give a geometry to a scene, which owns the geometry from now on. seen: mask of the kinds of rays that see it."""
    _library.rtcSetGeometryMask(geometry, seen)
    _library.rtcCommitGeometry(geometry)
    _library.rtcAttachGeometry(scene, geometry)
    _library.rtcReleaseGeometry(geometry)


def commit(scene: int) -> None:
    """Make a scene ready for rays."""
    _library.rtcSetSceneBuildQuality(scene, _BUILD_QUALITY_HIGH)
    _library.rtcCommitScene(scene)


def failure(device: int) -> int:
    """The code of the first error since the last call of this function; 0 if there was none."""
    return _library.rtcGetDeviceError(device)


def let_go(scene: int) -> None:
    """Release the scene. From now on only its instances own it."""
    _library.rtcReleaseScene(scene)
