"""Tangents of a UV map as MikkTSpace defines them (Morten Mikkelsen, http://www.mikktspace.com), on triangles as in Cycles.

Two differences: triangles that share only one vertex share its tangent if normal and UV are equal. A triangle without area in the UV map
has its own tangent.
"""

import numpy as np

Corners = np.ndarray  # (T, 3, n): a value for each corner of each triangle


def tangents(points: Corners, normals: Corners, uvs: Corners) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3, 3) float32 unit tangents along u at the corners, and the signs (T,) float32 that turn cross(normal, tangent) along v."""
    along, positive = _along_u(points, uvs)
    projected = _unit(_across(along[:, None, :], normals)) * _angles(points, normals)[..., None]
    group = _equal_corners(points, normals, uvs, positive)
    sums = np.stack([np.bincount(group, projected[..., axis].ravel()) for axis in range(3)], axis=1)
    return _unit(sums)[group].reshape(points.shape).astype(np.float32), np.where(positive, np.float32(1), np.float32(-1))


def _along_u(points: Corners, uvs: Corners) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3), the direction in which u grows; and (T,) bool, False if the UV map mirrors the triangle."""
    (a, b), (s, t) = (np.moveaxis(x[:, 1:].astype(np.float64) - x[:, :1], 1, 0) for x in (points, uvs))
    positive = s[:, 0] * t[:, 1] - s[:, 1] * t[:, 0] > 0
    along = t[:, 1:] * a - s[:, 1:] * b
    return np.where(positive[:, None], along, -along), positive


def _angles(points: Corners, normals: Corners) -> np.ndarray:
    """(T, 3), the angles of the triangles, seen along the normals."""
    to_next, to_last = (_unit(_across(np.roll(points, -step, axis=1).astype(np.float64) - points, normals)) for step in (1, 2))
    return np.arccos((to_next * to_last).sum(axis=2).clip(-1, 1))


def _equal_corners(points: Corners, normals: Corners, uvs: Corners, positive: np.ndarray) -> np.ndarray:
    """(3 T,) numbers. Two corners have equal numbers if all inputs of their tangents are equal."""
    side = np.repeat(positive[:, None, None], 3, axis=1)
    rows = np.concatenate([points, normals, uvs, side], axis=2, dtype=np.float32).reshape(3 * len(points), -1)
    rows += np.float32(0)  # a negative zero is a zero
    return np.unique(rows.view(np.dtype((np.void, rows.strides[0]))).ravel(), return_inverse=True)[1].ravel()


def _across(vectors: np.ndarray, normals: Corners) -> np.ndarray:
    """v - (v . n) n."""
    return vectors - (vectors * normals).sum(axis=2, keepdims=True) * normals


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1)
