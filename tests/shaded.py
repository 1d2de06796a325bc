"""Shaders with one closure, and the value of its first input at points of a small scene."""

import numpy as np

from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.kernels.pointers import ref
from blender_rl_guiding.kernels.sampling import F, store, vector
from blender_rl_guiding.scene.data import SceneData, Texture
from blender_rl_guiding.scene.description import CAMERA, IDENTITY, Camera, Closure, Instruction, Node, Shader
from blender_rl_guiding.shading.evaluate import run
from blender_rl_guiding.shading.operands import REGISTERS, Point, Shading, value

WINDOW = (-1.0, 1.0, -1.0, 1.0)
COLOR = 2  # the column of a closure's first input


def shader(*code: Instruction) -> Shader:
    """A shader that emits the colour of its last step."""
    return Shader("test", code, (Closure("emission", 1.0, {"color": Node(len(code) - 1)}),))


def scene(
    shaders: tuple[Shader, ...],
    corners: np.ndarray,
    attributes: tuple[np.ndarray, ...] = (),
    textures: tuple[Texture, ...] = (),
    tables: np.ndarray | None = None,
    object_attributes: np.ndarray | None = None,
) -> SceneData:
    """One object of triangles (T, 3, 3), with attributes of the same shape."""
    count = len(corners)
    return SceneData(
        name="test",
        vertices=corners.reshape(-1, 3).astype(np.float32),
        triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        normals=np.broadcast_to(np.float32((0, 0, 1)), (count, 3, 3)),
        material=np.zeros(count, np.int32),
        object=np.zeros(count, np.int32),
        shaders=shaders,
        camera=Camera(IDENTITY, WINDOW, 1, 1),
        attributes=np.concatenate([np.zeros((0, 3, 3)), *attributes]).astype(np.float32),
        attribute_rows=np.arange(len(attributes), dtype=np.int64).reshape(-1, 1) * count,
        object_attributes=np.zeros((0, 1, 3), np.float32) if object_attributes is None else object_attributes.astype(np.float32),
        textures=textures,
        tables=np.zeros((0, 256, 4), np.float32) if tables is None else tables.astype(np.float32),
    )


@kernel
def glow(shading, shader, points, triangles, uv, wo, backfacing, registers, out):
    """The colour of the shader's first closure at each point. The normal is +z."""
    shading = ref(shading)
    up = (F(0), F(0), F(1))
    closure = shading.closures[shading.shaders[shader, 2]]
    for i in range(len(points)):
        x = vector(points, i)
        point = Point(
            x, up, up, vector(wo, i), triangles[i], np.int32(0), uv[i, 0], uv[i, 1], backfacing, np.int32(CAMERA), F(1), np.int32(0)
        )
        run(shading, shader, ref(point), registers)
        store(out, i, value(shading, registers, closure[COLOR]))


def colors(
    shading: Shading, shader: int, corners: np.ndarray, uv: np.ndarray, wo: np.ndarray | None = None, backfacing: int = 0
) -> np.ndarray:
    """The shader's colour (T, 3) at one point (u, v) in each of T triangles (T, 3, 3)."""
    weights = np.stack([1 - uv.sum(axis=1), uv[:, 0], uv[:, 1]], axis=1)
    points = np.einsum("tc,tcx->tx", weights, corners).astype(np.float32)
    wo = np.tile(np.float32((0, 0, 1)), (len(points), 1)) if wo is None else wo.astype(np.float32)
    out, registers = np.empty((len(points), 3), np.float32), np.empty((REGISTERS, 3), np.float32)
    triangles = np.arange(len(points), dtype=np.int32)
    glow(shading, shader, points, triangles, uv.astype(np.float32), wo, np.int32(backfacing), registers, out)
    return out
