"""Lamps that rays seldom meet by chance: where light sampling is off, all they give is a few white dots. Needs nothing but numpy."""

import math

import numpy as np

from .data import SceneData
from .description import Lamp, Loss

LEAST = 1e-3  # share of the rays into a hemisphere; at 32 samples a pixel, that one ray in thirty pixels' first bounce meets the lamp
DETAIL = "too small to be found by chance, and next-event estimation is off: its light becomes a few white dots"


def left_to_chance(scene: SceneData, nee: bool) -> tuple[Loss, ...]:
    """A line for each lamp that has a size, and covers less than `LEAST` of the hemisphere as seen from the scene's middle."""
    if nee or not len(scene.triangles):
        return ()
    low, high = scene.bounds
    middle, radius = scene.origin + (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    return tuple(Loss(lamp.name, "", DETAIL) for lamp in scene.lamps if 0 < _share(lamp, middle, radius) < LEAST)


def _share(lamp: Lamp, middle: np.ndarray, radius: float) -> float:
    """Solid angle of a lamp over 2 pi, from the scene's middle, or half its radius away if it is nearer; 0 if rays cannot hit it."""
    if not lamp.mis or (lamp.kind == "area" and not lamp.spread):
        return 0.0
    if lamp.kind == "sun":
        return 1 - math.cos(lamp.radius)
    area = lamp.width * lamp.height if lamp.kind == "area" else math.pi * lamp.radius**2
    distance = max(float(np.linalg.norm(np.array(lamp.to_world)[:3, 3] - middle)), radius / 2, 1e-9)
    return area / (2 * math.pi * distance**2)
