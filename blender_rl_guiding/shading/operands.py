"""Shaders as kernels see them, and how kernels read a value.

An operand k is a whole number: row k of `constants` if k >= 0, register ~k if k < 0, or NONE.
"""

from typing import NamedTuple

import numpy as np

from ..kernels import part
from ..kernels.sampling import F
from ..scene.description import CLOSURES

KINDS = tuple(CLOSURES)  # a closure's kind is its place here
REGISTERS = 256
CODE_REGISTERS = REGISTERS - 32  # most that a shader's code may use; the others take the inputs of the closure that is read
NONE = -(2**31)


class Shading(NamedTuple):
    """All shaders of a scene; the last one is the world's."""

    shaders: np.ndarray  # (S, 4) int32: first and end of its code, first and end of its closures
    code: np.ndarray  # (I, 12) int32: op, mode, register written, up to 5 operands, up to 4 options
    closures: np.ndarray  # (K, 32) int32: kind, operand of the weight, operands of the inputs in the order of CLOSURES[kind]
    inputs: np.ndarray  # (K, 31, 3) float32: weight and inputs of each closure; 0 for those that vary
    varying: np.ndarray  # (V, 2) int32: for each input that varies, its place in `inputs` and the register with its value
    first_varying: np.ndarray  # (K + 1,) int32: first row of `varying` for each closure
    constants: np.ndarray  # (C, 3) float32
    tables: np.ndarray  # (R, 256, 4) float32
    textures: np.ndarray  # (X, 6) int64: first texel, width, height, kind of texels; number of the tile or 0, tiles that follow
    bytes: np.ndarray  # (B, 4) uint8, texels of all 8-bit textures
    floats: np.ndarray  # (N, 4) float32, texels of all others
    attributes: np.ndarray  # (N, 3, 3) float32, see SceneData
    attribute_rows: np.ndarray  # (A, O) int64: first row minus the object's first triangle; NONE where an object lacks it
    object_attributes: np.ndarray  # (B, O, 3) float32
    to_world: np.ndarray  # (I, 3, 4) float32, from mesh to world, of the last I objects, the instances; only its 3 x 3 is read
    origin: np.ndarray  # (3,) float32, the scene's origin in world space


class Point(NamedTuple):
    """The point at which a shader is evaluated. Vectors are tuples in world space; x is counted from the scene's origin.

    Without an object (-1), x is a position in the world on a lamp, wo for a sun, and the direction of the ray for the world.
    """

    x: tuple[F, F, F]
    n: tuple[F, F, F]  # shading normal, on wo's side of the surface
    ng: tuple[F, F, F]  # normal of the triangle, on wo's side
    wo: tuple[F, F, F]  # unit, towards where the ray came from; for the world, against the direction of the ray
    triangle: np.int32
    object: np.int32
    u: F  # barycentric coordinates of corners 1 and 2
    v: F
    backfacing: np.int32  # 1 if the ray arrives from behind the triangle, by its winding
    ray: np.int32  # the kind of ray, one of scene.ray_kinds
    distance: F  # length of the ray since the near clip or the last scattering event
    depth: np.int32  # scattering events before


@part
def make_point(x, n, ng, wo, triangle, object_, u, v, backfacing, ray, distance, depth):
    """A Point whose whole numbers are int32, so that functions of a Point are compiled once."""
    numbers = np.int32(triangle), np.int32(object_), np.int32(backfacing), np.int32(ray), np.int32(depth)
    return Point(x, n, ng, wo, numbers[0], numbers[1], u, v, numbers[2], numbers[3], distance, numbers[4])


@part
def value(shading, registers, operand):
    """The value of an operand, three numbers: a colour, a vector, or one number three times."""
    if operand >= 0:
        return shading.constants[operand, 0], shading.constants[operand, 1], shading.constants[operand, 2]
    return registers[~operand, 0], registers[~operand, 1], registers[~operand, 2]


@part
def number(shading, registers, operand):
    """The first number of an operand's value."""
    return shading.constants[operand, 0] if operand >= 0 else registers[~operand, 0]
