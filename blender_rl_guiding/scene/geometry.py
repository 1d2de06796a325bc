"""Triangles: ray queries by Embree, and the surface at a hit."""

from typing import NamedTuple

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from ..kernels import kernel
from ..sampling import F, add, dot, normalize, scale, vector
from .data import SceneData


class Surface(NamedTuple):
    """What the kernels know of the triangles and their materials."""

    face_normal: np.ndarray  # (T, 3) float32, unit geometric normal by winding
    normal: np.ndarray  # (T, 3, 3) float32, unit shading normal at each corner
    material: np.ndarray  # (T,) int32
    albedo: np.ndarray  # (M, 3) float32
    emission: np.ndarray  # (M, 3) float32, radiance, both sides


def surface(scene: SceneData) -> Surface:
    """The scene's triangles for the kernels."""
    corners = scene.vertices[scene.triangles].astype(np.float64)
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.linalg.norm(face, axis=1, keepdims=True)
    albedo = np.array([m.base_color for m in scene.materials], np.float32)
    emission = np.array([m.emission for m in scene.materials], np.float32)
    return Surface(face.astype(np.float32), scene.normals.copy(), scene.material.copy(), albedo, emission)


class RayQueries:
    """Closest hit and visibility over the scene's triangles. Any number of threads may call at once: Embree releases the GIL."""

    def __init__(self, scene: SceneData) -> None:
        self._scene = EmbreeScene()
        TriangleMesh(self._scene, scene.vertices.copy(), scene.triangles.copy())
        self.closest(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))  # the first query builds the tree

    def closest(self, origin: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Distance, triangle (-1 for none) and barycentrics u, v of each ray's first hit; rays are (n, 3) float32."""
        hit = self._scene.run(origin, direction, output=True)
        return hit["tfar"], hit["primID"], hit["u"], hit["v"]

    def visible(self, origin: np.ndarray, direction: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """Non-zero, (n,) int32, where nothing stands within `distance` along the ray."""
        return self._scene.run(origin, direction, dists=distance, query="OCCLUDED")


@kernel
def shading_normal(surface, triangle, u, v):
    """The interpolated unit normal at barycentrics u, v; the face's own where the corners' normals cancel."""
    n = surface.normal[triangle]
    a, b, c = (n[0, 0], n[0, 1], n[0, 2]), (n[1, 0], n[1, 1], n[1, 2]), (n[2, 0], n[2, 1], n[2, 2])
    between = add(add(scale(a, F(1) - u - v), scale(b, u)), scale(c, v))
    return normalize(between) if dot(between, between) > F(1e-8) else vector(surface.face_normal, triangle)


@kernel
def off_surface(point, face_normal, distance):
    """Move a hit point to the face normal's side of its surface, by more than the rounding error of a hit at that distance."""
    size = max(max(abs(point[0]), abs(point[1])), max(abs(point[2]), distance))
    return add(point, scale(face_normal, F(3e-5) * size))
