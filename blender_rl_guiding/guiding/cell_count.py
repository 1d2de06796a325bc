"""Predicts the number of cells that a guide will find in a scene, from random points on its surfaces."""

import math
from weakref import WeakKeyDictionary

import numpy as np

from ..scene.data import SceneData, sizes
from .cells import cell_size
from .directions import NORMAL_STEPS

POINTS = 1 << 17
_BLOCK = 1 << 14  # triangles at a time: the arithmetic stays in the processor's cache
_counted: WeakKeyDictionary[SceneData, dict[int, float]] = WeakKeyDictionary()  # n by `along`: every render of a scene asks


def cells_found(scene: SceneData, along: int, visits: float) -> float:
    """The number of cells that `visits` transitions find if they are uniform over all surfaces: n (1 - exp(-visits / n)), n cells in all.

    along: cells along the scene's longest side. Surfaces that no path reaches count, too. Two-sided surfaces count once.
    """
    counted = _counted.setdefault(scene, {})
    if along not in counted:
        counted[along] = _cells(scene, along)
    return counted[along] * -math.expm1(-visits / counted[along])


def _cells(scene: SceneData, along: int) -> float:
    """n, the number of cells that contain a part of a surface."""
    if not len(scene.triangles):
        return 1.0
    position, normal = _on_surfaces(scene, np.random.default_rng(0))
    steps = np.floor((position - position.min(axis=0)) / cell_size(scene, along) + 0.5).astype(np.int64)
    turns = np.floor(normal * NORMAL_STEPS + 0.5).astype(np.int64) + NORMAL_STEPS
    key = np.zeros(POINTS, np.int64)
    for column in (*steps.T, *turns.T):  # as `directions.cell_key`, but steps do not wrap at 16 bits
        key = key * 1_000_003 + column
    return _all(len(np.unique(key)), POINTS)


def _all(found: int, draws: int) -> float:
    """The n that solves n (1 - exp(-draws / n)) = found, at most 64 * draws. At that n nearly all draws find different cells."""
    low, high = float(found), 64.0 * draws
    while high - low > 1e-3 * high:
        n = (low + high) / 2
        low, high = (n, high) if n * -math.expm1(-draws / n) < found else (low, n)
    return high


def _on_surfaces(scene: SceneData, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Random points and their unit shading normals, (POINTS, 3) each, uniform over the area of all triangles, also of instances."""
    ends = np.cumsum(_areas(scene))
    world = len(scene.object)
    starts = np.concatenate([[0], scene.meshes]) if len(scene.meshes) else np.zeros(1, np.int64)
    counts = np.concatenate([[world], sizes(scene)])
    before = np.where(starts > 0, ends[starts - 1], 0.0)
    area = np.where(counts > 0, ends[starts + counts - 1] - before, 0.0)  # of the world's triangles, and of each mesh
    part = np.concatenate([[0], scene.instances + 1])
    matrices = scene.instance_to_world.astype(np.float64)
    larger = np.concatenate([[1.0], np.abs(np.linalg.det(matrices[:, :, :3])) ** (2 / 3)])
    shares = np.cumsum(area[part] * larger)
    owner = np.searchsorted(shares, rng.random(POINTS) * shares[-1]).clip(max=len(part) - 1)
    of = part[owner]
    triangle = np.searchsorted(ends, before[of] + rng.random(POINTS) * area[of]).clip(max=len(ends) - 1)
    u, v = np.sort(rng.random((2, POINTS)), axis=0)
    weights = np.stack([u, v - u, 1 - v])[:, :, None]
    position = (scene.vertices[scene.triangles[triangle].T].astype(np.float64) * weights).sum(axis=0)
    normal = (scene.normals[triangle].transpose(1, 0, 2).astype(np.float64) * weights).sum(axis=0)
    moved = owner > 0
    own = matrices[owner[moved] - 1]
    position[moved] = np.einsum("nij,nj->ni", own[:, :, :3], position[moved]) + own[:, :, 3]
    normal[moved] = np.einsum("nji,nj->ni", np.linalg.inv(own[:, :, :3]), normal[moved])
    return position, normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)


def _areas(scene: SceneData) -> np.ndarray:
    """(T,) areas of all triangles, in their own space."""
    areas = np.empty(len(scene.triangles))
    for start in range(0, len(areas), _BLOCK):
        corners = scene.vertices.take(scene.triangles[start : start + _BLOCK].T, axis=0).astype(np.float64)
        a, b, c = corners.transpose(0, 2, 1)
        (x, y, z), (u, v, w) = b - a, c - a
        areas[start : start + _BLOCK] = np.sqrt((y * w - z * v) ** 2 + (z * u - x * w) ** 2 + (x * v - y * u) ** 2) / 2
    return areas
