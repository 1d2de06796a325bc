"""Meshes that instances place in the world: where these are, and what makes a table of them impossible. Needs nothing but numpy."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from .description import emits

if TYPE_CHECKING:
    from .data import SceneData

_BLOCK = 1 << 16  # instances whose arithmetic stays in the cache
_LEAST_DETERMINANT = 1e-24  # below that a matrix has no inverse in float32


def runs(values: np.ndarray) -> Iterator[tuple[int, int]]:
    """First and end of each run of equal values."""
    starts = np.flatnonzero(np.diff(values, prepend=values[:1] - 1))
    return pairwise([*starts.tolist(), len(values)])


def placed(scene: SceneData) -> int:
    """P, the number of objects that are no instances."""
    return len(scene.visibility) - len(scene.instances)


def first_triangles(scene: SceneData) -> np.ndarray:
    """(O,) the first triangle of each object."""
    return np.concatenate([np.searchsorted(scene.object, np.arange(placed(scene))), scene.meshes[scene.instances]])


def sizes(scene: SceneData) -> np.ndarray:
    """(M,) triangles of each mesh."""
    return np.diff(scene.meshes, append=len(scene.triangles))


def world_vertices(scene: SceneData) -> int:
    """The number of vertices in world space."""
    return int(scene.triangles[scene.meshes[0] :].min()) if len(scene.meshes) else len(scene.vertices)


def box(scene: SceneData) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corner, (3,) float32, of a box around all: around the boxes of instances, not their vertices."""
    world = scene.vertices[: world_vertices(scene)]
    corners = [np.stack([world.min(axis=0), world.max(axis=0)])] if len(world) else []
    corners += [np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)]) for boxes in boxes_of(scene)]
    return np.min(corners, axis=0)[0], np.max(corners, axis=0)[1]


def boxes_of(scene: SceneData) -> Iterator[np.ndarray]:
    """(n, 2, 3) float32, lowest and highest corner around each instance, in their order, some at a time."""
    ends = scene.meshes + sizes(scene)
    for first, end in runs(scene.instances):
        mesh = scene.instances[first]
        corners = scene.triangles[scene.meshes[mesh] : ends[mesh]]
        vertices = scene.vertices[corners.min() : corners.max() + 1]
        low, high = vertices.min(axis=0).astype(np.float64), vertices.max(axis=0).astype(np.float64)
        for start in range(first, end, _BLOCK):
            yield _placed_boxes(scene.instance_to_world[start : min(start + _BLOCK, end)], low, high)


def _placed_boxes(matrices: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    middle = matrices[:, :, :3] @ ((low + high) / 2) + matrices[:, :, 3]
    half = np.abs(matrices[:, :, :3]) @ ((high - low) / 2)
    return np.stack([middle - half, middle + half], axis=1).astype(np.float32)


def invertible(matrices: np.ndarray) -> np.ndarray:
    """(N,) bool, for the left 3 x 3 of matrices (N, 3, 3 or 4)."""
    rows = matrices[:, :, :3].astype(np.float64)
    return np.abs((np.cross(rows[:, 0], rows[:, 1]) * rows[:, 2]).sum(axis=1)) > _LEAST_DETERMINANT


def find_bad_table(scene: SceneData) -> str:
    """What is wrong with the indices of meshes and instances, in one line; empty if nothing is."""
    meshes, instances, triangles = scene.meshes, scene.instances, len(scene.triangles)
    if len(meshes) and (meshes.min() < 0 or meshes.max() >= triangles or (meshes[1:] <= meshes[:-1]).any()):
        return f"meshes begin at triangles {meshes.min()}..{meshes.max()} of {triangles}, which must rise"
    if len(meshes) and scene.triangles[: meshes[0]].max(initial=-1) >= world_vertices(scene):
        return f"vertex {world_vertices(scene)} is of a mesh, but vertices of triangles in the world follow"
    if len(meshes) and not len(instances):
        return f"{len(meshes)} meshes of instances, but no instances"
    if len(instances) != len(scene.instance_to_world) or len(instances) > len(scene.visibility):
        return f"{len(instances)} instances, but {len(scene.instance_to_world)} instance_to_world and {len(scene.visibility)} objects"
    if len(instances) and (instances.min() < 0 or instances.max() >= len(meshes) or (instances[1:] < instances[:-1]).any()):
        return f"instances are of meshes {instances.min()}..{instances.max()} of {len(meshes)}, which must never fall"
    return ""


def find_singular(scene: SceneData) -> str:
    """The first instance whose matrix has no inverse, in one line; empty if there is none."""
    for start in range(0, len(scene.instances), _BLOCK):
        if not (good := invertible(scene.instance_to_world[start : start + _BLOCK])).all():
            return f"instance {start + good.argmin()} has a matrix without an inverse"
    return ""


def find_shining(scene: SceneData) -> str:
    """The first material of meshes of instances that emits, in one line; empty if there is none. Lights are sampled by triangle."""
    for shader in np.unique(scene.material[len(scene.object) :]):
        if any(map(emits, scene.shaders[shader].closures)):
            return f"a mesh of instances emits, by shader {scene.shaders[shader].name!r}"
    return ""
