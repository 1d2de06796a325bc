"""Casts rays against triangles, and computes the surface at a hit. Kernels call Embree.

`embree` declares the calls. Reasons: docs/decisions/0006, 0012 and 0015.
"""

import math
import weakref
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..kernels import kernel, part, unlikely
from ..kernels.sampling import F, add, cross, dot, normalize, scale, subtract, vector
from ..scene.data import SceneData, placed, runs, sizes, world_vertices
from ..scene.ray_kinds import MESHES, seen_by
from . import embree
from .placing import normal_to_world, placing_error, point_to_world

RAY_WORDS = 24  # words of 4 bytes in an RTCRayHit, its padding included
# The word where each member of RTCRayHit begins. Ray: origin (0) and tnear, direction and time, tfar, mask, id, flags. Hit: normal, u, v,
# triangle, geometry, array of instances, place in this array.
NEAR, DIRECTION, FAR, MASK, FLAGS, NORMAL, U, V, TRIANGLE, GEOMETRY, INSTANCES, PLACE = 3, 4, 8, 9, 11, 12, 15, 16, 17, 18, 19, 20


class Rays(NamedTuple):
    """The RTCRayHit of one thread: the same memory as float32 and as int32."""

    floats: np.ndarray  # (24,) float32, aligned to 16 bytes
    words: np.ndarray  # (24,) int32, the same memory


class Surface(NamedTuple):
    """The triangles as arrays for the kernels."""

    embree: int  # address of the RTCScene
    first: np.ndarray  # (G,) int32, first triangle of each of Embree's geometries
    first_object: np.ndarray  # (G,) int32, for each geometry: object of its first instance; 0 if it has no instances
    placed: int  # index of the first object that is an instance
    to_world: np.ndarray  # (I, 3, 4) float32, for each instance: from its mesh's space to positions relative to the scene's origin
    vertices: np.ndarray  # (V, 3) float32, relative to the scene's origin; vertices of meshes are in the space of the mesh
    triangles: np.ndarray  # (T, 3) int32
    normal: np.ndarray  # (T, 3, 3) float32, unit shading normal at each corner
    smooth: np.ndarray  # (T,) bool, whether any corner's normal differs from the triangle's own
    error: np.ndarray  # (T,) float32, distance of a ray's start from the triangle: a bound on the rounding of its points
    material: np.ndarray  # (T,) int32
    object: np.ndarray  # (W,) int32, object of each triangle in world space


class Geometry:
    """The scene's triangles in Embree, as long as this object lives. Several threads may cast rays at the same time.

    InputError if Embree cannot hold the triangles.
    """

    def __init__(self, scene: SceneData) -> None:
        self._scene = scene  # keeps the scene's arrays alive: Embree reads its triangles without a copy
        self._numbers = np.zeros(scene.vertices.size + 1, F)  # one more number: Embree reads 16 bytes of the last vertex, too
        vertices = self._numbers[:-1].reshape(-1, 3)
        vertices[:] = scene.vertices
        vertices[: world_vertices(scene)] -= scene.origin
        vertices.setflags(write=False)
        self._to_world = scene.instance_to_world
        if scene.origin.any():
            self._to_world = self._to_world.copy()
            self._to_world[:, :, 3] -= scene.origin
            self._to_world.setflags(write=False)
        device, handle = embree.new_device_and_scene()
        weakref.finalize(self, embree.release, handle, device)
        first = self._attach_triangles(device, handle)
        meshes, first_object = self._attach_instances(device, handle)
        embree.commit(handle)
        if error := embree.failure(device):
            raise InputError(f"Embree cannot hold {len(scene.triangles)} triangles and {len(scene.instances)} instances: error {error}")
        smooth, rounding = np.empty(len(scene.triangles), bool), np.empty(len(scene.triangles), F)
        measure(vertices, scene.triangles, scene.normals, smooth, rounding)
        self.surface = Surface(
            handle,
            np.array(first + meshes, np.int32),
            np.array([0] * len(first) + first_object, np.int32),
            placed(scene),
            self._to_world,
            vertices,
            scene.triangles,
            scene.normals,
            smooth,
            rounding,
            scene.material,
            scene.object,
        )

    def _attach_triangles(self, device: int, handle: int) -> list[int]:
        """Attach one geometry for each run of triangles with equal visibility. Returns the first triangle of each geometry."""
        seen = seen_by(self._scene.visibility, MESHES)[self._scene.object]
        found = list(runs(seen))
        for start, end in found:
            embree.attach(handle, self._triangles(device, start, end), int(seen[start]))
        return [start for start, _ in found]

    def _attach_instances(self, device: int, handle: int) -> tuple[list[int], list[int]]:
        """Attach one geometry for each run of instances with equal mesh and visibility.

        Returns, for each geometry, (first triangle of its mesh, object of its first instance), as two lists.
        """
        scene, objects = self._scene, placed(self._scene)
        seen = seen_by(scene.visibility, MESHES)[objects:]
        found = list(runs(scene.instances.astype(np.int64) << 32 | seen))
        ends, meshes = scene.meshes + sizes(scene), {}
        for start, end in found:
            mesh = int(scene.instances[start])
            if mesh not in meshes:
                meshes[mesh] = embree.scene_of(device, self._triangles(device, int(scene.meshes[mesh]), int(ends[mesh])))
            embree.attach(handle, embree.instances(device, meshes[mesh], self._to_world[start:end]), int(seen[start]))
        for mesh in meshes.values():
            embree.let_go(mesh)
        return [int(scene.meshes[scene.instances[start]]) for start, _ in found], [objects + start for start, _ in found]

    def _triangles(self, device: int, start: int, end: int) -> int:
        return embree.triangles(device, self._scene.triangles[start:end], self._numbers)


@kernel
def measure(vertices, triangles, normals, smooth, error):
    """Write `smooth` and `error` of each triangle. smooth: whether a corner's normal differs from the face's. error: `_rounding`."""
    for i in range(triangles.shape[0]):
        p, n = triangles[i], normals[i]
        a, b, c = vector(vertices, p[0]), vector(vertices, p[1]), vector(vertices, p[2])
        own = normalize(cross(subtract(b, a), subtract(c, a)))
        smooth[i] = _differ(own, vector(n, 0)) or _differ(own, vector(n, 1)) or _differ(own, vector(n, 2))
        error[i] = _rounding(a, subtract(b, a), subtract(c, a))


@part
def _rounding(a, e, f):
    """A bound on the distance between a triangle's points from `hit_point` and the triangle's plane in Embree.

    The triangle has the corner a, the edges e and f from a, and n = e x f. The first term bounds the rounding of positions along the
    normal: 2^-22 sum_i |n_i| (max |corner_i| + |e_i| + |f_i|) / |n|. The second term bounds the tilt of a sliver's plane by the rounding
    of e x f. Both are about twice the largest measured need (docs/decisions/0012).
    """
    a, e, f = _doubled(a), _doubled(e), _doubled(f)
    n = cross(e, f)
    area = max(math.sqrt(dot(n, n)), 1e-300)
    placed, tilt, size = 0.0, 0.0, 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        edge = max(abs(e[i]), abs(f[i]))
        placed += abs(n[i]) * (max(abs(a[i]), abs(a[i] + e[i]), abs(a[i] + f[i])) + abs(e[i]) + abs(f[i]))
        tilt += edge * (abs(e[j] * f[k]) + abs(e[k] * f[j]))
        size += edge
    return F(2**-22 * placed / area + 2**-23 * min(tilt / area, 4096.0 * size))


@part
def _doubled(v):
    return np.float64(v[0]), np.float64(v[1]), np.float64(v[2])


@part
def _differ(a, b):
    d = subtract(a, b)
    return dot(d, d) > F(1e-10)


def rays() -> Rays:
    """Memory for the rays of one thread, aligned to 16 bytes."""
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
    """The index of the first triangle on a ray that rays of this `kind` see; -1 if there is none.

    Writes to `rays`: distance (FAR), barycentrics (U, V), and the normal by winding, not unit, in the triangle's own space (NORMAL).
    """
    _prepare(rays, origin, direction, near, far, kind)
    rays.words[GEOMETRY] = -1
    rays.words[INSTANCES] = -1
    embree.intersect(surface.embree, rays.floats.ctypes.data, 0)
    geometry = max(rays.words[GEOMETRY], rays.words[INSTANCES])  # at an instance GEOMETRY is 0: the scene of a mesh has one geometry
    return surface.first[geometry] + rays.words[TRIANGLE] if geometry >= 0 else np.int32(-1)


@part
def object_hit(surface, rays, triangle):
    """The object of the hit in `rays`. triangle: the triangle of the hit."""
    instances = rays.words[INSTANCES]
    return surface.object[triangle] if instances < 0 else np.int32(surface.first_object[instances] + rays.words[PLACE])


@part
def occluded(surface, rays, origin, direction, far, kind):
    """Whether the ray hits, within the distance `far`, a triangle that rays of this `kind` see."""
    _prepare(rays, origin, direction, F(0), far, kind)
    embree.occluded(surface.embree, rays.floats.ctypes.data, 0)
    return rays.floats[FAR] < F(0)


@part
def shading_normal(surface, triangle, u, v, face_normal):
    """The interpolated unit normal at barycentrics u, v, in the space of the triangle.

    The result is `face_normal` if the triangle is flat, or if the normals of its corners cancel.
    """
    if not surface.smooth[triangle]:
        return face_normal
    n = surface.normal[triangle]
    a, b, c = (n[0, 0], n[0, 1], n[0, 2]), (n[1, 0], n[1, 1], n[1, 2]), (n[2, 0], n[2, 1], n[2, 2])
    between = add(add(scale(a, F(1) - u - v), scale(b, u)), scale(c, v))
    return normalize(between) if dot(between, between) > F(1e-8) else face_normal


@part
def facing(surface, rays, triangle, object_, ray):
    """(n, ng, whether the ray arrives from behind) of the hit in `rays`. n, ng: unit shading and geometric normal.

    Both normals are in world space, on the side of the triangle where the ray comes from. ray: direction of the ray.
    """
    ng = normalize((rays.floats[NORMAL], rays.floats[NORMAL + 1], rays.floats[NORMAL + 2]))
    n = shading_normal(surface, triangle, rays.floats[U], rays.floats[V], ng)
    if unlikely(object_ >= surface.placed):
        i = object_ - surface.placed
        n, ng = normal_to_world(surface.to_world, i, n), normal_to_world(surface.to_world, i, ng)
    if dot(ng, ray) <= F(0):
        return n, ng, False
    return scale(n, F(-1)), scale(ng, F(-1)), True


@part
def corners_of(surface, triangle, object_):
    """The corners a, b, c of an object's triangle, relative to the scene's origin, and the shading normals at them."""
    (a, b, c), normals = _own_corners(surface, triangle), surface.normal[triangle]
    n_a, n_b, n_c = vector(normals, 0), vector(normals, 1), vector(normals, 2)
    if unlikely(object_ >= surface.placed):
        i, m = object_ - surface.placed, surface.to_world
        a, b, c = point_to_world(m, i, a), point_to_world(m, i, b), point_to_world(m, i, c)
        n_a, n_b, n_c = normal_to_world(m, i, n_a), normal_to_world(m, i, n_b), normal_to_world(m, i, n_c)
    return a, b, c, n_a, n_b, n_c


@part
def _own_corners(surface, triangle):
    """The corners of a triangle in its own space."""
    p = surface.triangles[triangle]
    return vector(surface.vertices, p[0]), vector(surface.vertices, p[1]), vector(surface.vertices, p[2])


@part
def hit_point(surface, triangle, object_, u, v):
    """(x, error): the point of a triangle at barycentrics u, v, relative to the scene's origin, and a bound on its rounding.

    Rays start at the distance `error` from x. x is not computed as origin + t direction, because the error of that grows with t.
    """
    a, b, c = _own_corners(surface, triangle)
    x, error = add(a, add(scale(subtract(b, a), u), scale(subtract(c, a), v))), surface.error[triangle]
    if unlikely(object_ >= surface.placed):
        i, m = object_ - surface.placed, surface.to_world
        return point_to_world(m, i, x), placing_error(m, i, x, error)
    return x, error


@part
def off_surface(x, side, error):
    """x + error * side, for x and error from `hit_point` and a unit vector `side`."""
    return add(x, scale(side, error))
