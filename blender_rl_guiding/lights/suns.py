"""Discs of suns in the world's shader: their directions, their brightness, and the world without them."""

import math
from dataclasses import replace

import numpy as np

from ..kernels.sampling import LUMINANCE
from ..scene.description import Closure, Instruction, Node, Shader
from ..shading.operands import Shading
from ..shading.program import compile_alone
from .world import Sun, radiance

_OFF = 1e-4  # largest error of a matrix that counts as orthogonal
_WIDER, _MORE = 1.001, 2e-6  # factor and radians that widen a cone, so that rounding leaves no bright direction outside
_PROBES = 64  # directions that average the brightness of a disc


def without_suns(world: Shader, shading: Shading) -> tuple[Shading, list[Sun]]:
    """(shaders whose last one is the world without its suns; these suns).

    Only discs that are cones of directions are removed. A disc stays if its coordinates are changed by more than rotation and mirroring.
    """
    if all(step.op != "sun_disc" for step in world.code):
        return shading, []
    whole, suns, code = compile_alone(world, shading), [], list(world.code)
    for k, step in enumerate(world.code):
        if step.op == "sun_disc" and (cone := _cone(world, k, shading)):
            axis, half = cone
            mean = (radiance(whole, around(axis, half, _PROBES)) @ LUMINANCE).mean()
            suns.append(Sun(axis, half, mean * 4 * math.pi * math.sin(half / 2) ** 2))
            code[k] = replace(step, inputs=(*step.inputs[:4], 0.0))
    return compile_alone(replace(world, code=tuple(code)), shading), suns


def _cone(world: Shader, k: int, shading: Shading) -> tuple[np.ndarray, float] | None:
    """Axis, (3,) unit, and half angle, radians, of the disc in step k; None if the disc is not a cone of directions."""
    direction, _, elevation, size, _ = world.code[k].inputs
    if not (isinstance(direction, Node) and isinstance(elevation, float) and isinstance(size, float)):
        return None
    turned = _turned(world, direction, shading)
    if turned is None:
        return None
    axis = turned.T @ (0.0, math.cos(elevation), math.sin(elevation))
    return axis / np.linalg.norm(axis), size / 2 * _WIDER + _MORE


def _turned(world: Shader, value: Node, shading: Shading) -> np.ndarray | None:
    """The orthogonal 3 x 3 matrix M with `value` = M direction for all directions of rays; None if there is no such M."""
    probes = np.concatenate([np.eye(3), around(np.array((0.0, 0.0, 1.0)), math.pi, _PROBES)])
    as_color = Instruction("vector_math", (value, 0.5, 0.5, 0.0), "MULTIPLY_ADD")  # to 0..1, because colours are not negative
    shader = Shader("", (*world.code, as_color), (Closure("emission", 1.0, {"color": Node(len(world.code))}),))
    values = 2 * radiance(compile_alone(shader, shading), probes) - 1
    matrix = values[:3].T
    same = np.abs(probes @ matrix.T - values).max() < _OFF and np.abs(matrix @ matrix.T - np.eye(3)).max() < _OFF
    return matrix if same else None


def around(axis: np.ndarray, half: float, count: int) -> np.ndarray:
    """(count, 3), unit vectors spread evenly over the solid angle of a cone of half angle `half`, radians."""
    z = 1 - (np.arange(count) + 0.5) / count * 2 * math.sin(half / 2) ** 2
    turn = np.arange(count) * (math.pi * (3 - math.sqrt(5)))
    aside = np.eye(3)[np.abs(axis).argmin()]
    x = np.cross(axis, aside) / np.linalg.norm(np.cross(axis, aside))
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1) @ np.stack([x, np.cross(axis, x), axis])
