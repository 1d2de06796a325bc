"""Whether the camera's clip distances, which Cycles obeys and the bundle does not know, would hide anything that is in view."""

from collections.abc import Iterator

import bpy
import numpy as np

from blender_rl_guiding.scene.data import Camera, Loss

from .geometry import apply


def clipped(thing: bpy.types.Object, camera: Camera, vertices: np.ndarray, triangles: np.ndarray) -> Iterator[Loss]:
    """What is lost for surfaces in view that are nearer than clip start or farther than clip end."""
    to_world = np.array(camera.to_world)
    to_camera = to_world[:3, :3].T
    x, y, z = np.ascontiguousarray(apply(to_camera, vertices, -to_camera @ to_world[:3, 3]).T)
    sides = (-z * camera.tan_x - x, x - z * camera.tan_x, -z * camera.tan_y - y, y - z * camera.tan_y)
    near, far = thing.data.clip_start, thing.data.clip_end
    if _any_inside((near + z, *sides), triangles):
        yield Loss(thing.name, "camera", f"clip start {near:g}: surfaces nearer than that are in the image")
    if _any_inside((-z - far, *sides), triangles):
        yield Loss(thing.name, "camera", f"clip end {far:g}: surfaces farther than that are in the image where nothing hides them")


def _any_inside(distances: tuple[np.ndarray, ...], triangles: np.ndarray) -> bool:
    """Whether some triangle reaches into a convex region, given the signed distances of all vertices from each of its planes."""
    codes = np.zeros(len(distances[0]), np.uint8)
    for plane, distance in enumerate(distances):
        codes |= (distance <= 0).astype(np.uint8) << plane
    a, b, c = triangles.T
    undecided = triangles[codes[a] & codes[b] & codes[c] == 0]  # the others lie behind one plane
    return any(_reaches([np.array([d[corner] for d in distances], np.float64) for corner in corners]) for corners in undecided)


def _reaches(polygon: list[np.ndarray]) -> bool:
    """Sutherland and Hodgman's clipping, on distances instead of points: they are linear along edges, too."""
    for plane in range(5):
        polygon = [p for start, end in zip(polygon, polygon[1:] + polygon[:1], strict=True) for p in _kept(start, end, plane)]
    return bool(polygon)


def _kept(start: np.ndarray, end: np.ndarray, plane: int) -> Iterator[np.ndarray]:
    """What follows along an edge after its start, on the inside: the point where it crosses the plane, and its end."""
    if (start[plane] > 0) != (end[plane] > 0):
        yield start + (end - start) * (start[plane] / (start[plane] - end[plane]))
    if end[plane] > 0:
        yield end
