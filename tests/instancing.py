"""One scene in two forms: with instances of a mesh, and with the triangles of all instances in world space."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from blender_rl_guiding.scene.data import SceneData, placed
from blender_rl_guiding.scene.description import VISIBLE


def with_instances(scene: SceneData, mesh: SceneData, matrices: Sequence[np.ndarray] | np.ndarray) -> SceneData:
    """The scene with I instances of a mesh. mesh: a scene with the mesh's triangles and shaders. matrices (I, 3, 4): mesh to world."""
    shaders = (*scene.shaders, *mesh.shaders)
    count, objects = len(matrices), len(scene.visibility)
    return replace(
        scene,
        vertices=np.concatenate([scene.vertices, mesh.vertices]),
        triangles=np.concatenate([scene.triangles, mesh.triangles + np.int32(len(scene.vertices))]),
        normals=np.concatenate([scene.normals, mesh.normals]),
        material=np.concatenate([scene.material, mesh.material + np.int32(len(scene.shaders))]),
        shaders=shaders,
        attribute_rows=np.zeros((0, objects + count), np.int64),
        visibility=np.concatenate([scene.visibility[:objects], np.full(count, VISIBLE, np.uint8)]),
        meshes=np.array([len(scene.triangles)], np.int32),
        instances=np.zeros(count, np.int32),
        instance_to_world=np.asarray(matrices, np.float32),
    )


def flattened(scene: SceneData) -> SceneData:
    """The scene with the triangles of all instances in world space. If a matrix mirrors, the corners are in reverse order."""
    ends = np.append(scene.meshes[1:], len(scene.triangles))
    world, first = len(scene.object), placed(scene)
    parts = [(scene.vertices[scene.triangles[:world]], scene.normals[:world], scene.material[:world], scene.object)]
    attributes, rows = [scene.attributes], scene.attribute_rows.copy()
    for i, mesh in enumerate(scene.instances):
        own = slice(scene.meshes[mesh], ends[mesh])
        matrix = scene.instance_to_world[i].astype(np.float64)
        order = slice(None, None, 1 if np.linalg.det(matrix[:, :3]) > 0 else -1)
        corners = scene.vertices[scene.triangles[own]] @ matrix[:, :3].T + matrix[:, 3]
        normals = scene.normals[own] @ np.linalg.inv(matrix[:, :3])
        normals /= np.linalg.norm(normals, axis=2, keepdims=True)
        objects = np.full(len(corners), first + i, np.int32)
        parts.append((corners[:, order], normals[:, order], scene.material[own], objects))
        for k in np.flatnonzero(rows[:, first + i] >= 0):
            row = scene.attribute_rows[k, first + i]
            rows[k, first + i] = sum(map(len, attributes))
            attributes.append(scene.attributes[row : row + len(corners)][:, order])
    corners, normals, material, objects = (np.concatenate(column) for column in zip(*parts, strict=True))
    return replace(
        scene,
        vertices=corners.reshape(-1, 3).astype(np.float32),
        triangles=np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3),
        normals=normals.astype(np.float32),
        material=material,
        object=objects,
        attributes=np.concatenate(attributes),
        attribute_rows=rows,
        meshes=scene.meshes[:0],
        instances=scene.instances[:0],
        instance_to_world=scene.instance_to_world[:0],
    )


def matrix(scale: tuple[float, float, float], turn: float, shift: tuple[float, float, float]) -> np.ndarray:
    """The matrix (3, 4) that scales, turns around an oblique axis, then shifts."""
    axis = np.array((1.0, 2.0, 2.0)) / 3
    cross = np.cross(np.eye(3), axis)
    rotation = np.eye(3) + np.sin(turn) * -cross + (1 - np.cos(turn)) * cross @ cross
    return np.column_stack([rotation @ np.diag(scale), shift])
