"""Shaders as arrays for the kernels, and the reading of a value.

An operand k is a whole number, which names a value: row k of `constants` if k >= 0, register ~k if k < 0, or NONE.
"""

from typing import NamedTuple

import numpy as np

from ..kernels import part
from ..kernels.sampling import F
from ..scene.description import CLOSURES

KINDS = tuple(CLOSURES)  # a closure's kind is a place in this tuple
REGISTERS = 256
CODE_REGISTERS = REGISTERS - 32  # registers for a shader's code; the other 32 are for the inputs of the closure that is read
NONE = -(2**31)


class Shading(NamedTuple):
    """All shaders of a scene; the last one is the shader of the world."""

    shaders: np.ndarray  # (S, 4) int32: first and end of its code, first and end of its closures
    code: np.ndarray  # (I, 12) int32: op, mode, register written, up to 5 operands, up to 4 options
    closures: np.ndarray  # (K, 32) int32: kind, operand of the weight, operands of the inputs in the order of CLOSURES[kind]
    inputs: np.ndarray  # (K, 31, 3) float32: weight and inputs of each closure; 0 for inputs that vary
    varying: np.ndarray  # (V, 2) int32: for each input that varies, its row in `inputs` and the register of its value
    first_varying: np.ndarray  # (K + 1,) int32: first row of `varying` for each closure
    constants: np.ndarray  # (C, 3) float32
    tables: np.ndarray  # (R, 256, 4) float32
    textures: np.ndarray  # (X, 6) int64: first texel, width, height, kind of texels, number of the tile or 0, number of tiles that follow
    bytes: np.ndarray  # (B, 4) uint8, texels of all 8-bit textures
    floats: np.ndarray  # (N, 4) float32, texels of all float textures
    attributes: np.ndarray  # (N, 3, 3) float32, see SceneData
    attribute_rows: np.ndarray  # (A, O) int64: first row minus the object's first triangle; NONE where an object lacks it
    object_attributes: np.ndarray  # (B, O, 3) float32
    to_world: np.ndarray  # (I, 3, 4) float32, from mesh to world, for the last I objects (the instances); only the left 3 x 3 is read
    origin: np.ndarray  # (3,) float32, the scene's origin in world space


class Point(NamedTuple):
    """The point where a shader runs. Vectors are tuples in world space; x is relative to the scene's origin, metres.

    Without an object (-1), x is a world position for a lamp, wo for a sun, and the direction of the ray for the world.
    """

    x: tuple[F, F, F]
    n: tuple[F, F, F]  # shading normal, on wo's side of the surface
    ng: tuple[F, F, F]  # normal of the triangle, on wo's side
    wo: tuple[F, F, F]  # unit, opposite to the direction of the ray
    triangle: np.int32
    object: np.int32
    u: F  # barycentric coordinates of corners 1 and 2
    v: F
    backfacing: np.int32  # 1 if the ray arrives from behind the triangle, by its winding
    ray: np.int32  # the kind of ray, one of scene.ray_kinds
    distance: F  # length of the ray since the near clip or the last scattering event
    depth: np.int32  # scattering events before this point


@part
def make_point(x, n, ng, wo, triangle, object_, u, v, backfacing, ray, distance, depth):
    """A Point with all whole numbers as int32, so that Numba compiles functions of a Point only once."""
    numbers = np.int32(triangle), np.int32(object_), np.int32(backfacing), np.int32(ray), np.int32(depth)
    return Point(x, n, ng, wo, numbers[0], numbers[1], u, v, numbers[2], numbers[3], distance, numbers[4])


@part
def value(shading, registers, operand):
    """The value of an operand as three numbers: a colour, a vector, or one number three times."""
    if operand >= 0:
        return shading.constants[operand, 0], shading.constants[operand, 1], shading.constants[operand, 2]
    return registers[~operand, 0], registers[~operand, 1], registers[~operand, 2]


@part
def number(shading, registers, operand):
    """The first number of an operand's value."""
    return shading.constants[operand, 0] if operand >= 0 else registers[~operand, 0]
