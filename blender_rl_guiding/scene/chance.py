"""Lamps so small that rays seldom meet them: without light sampling they give a few white dots. Needs nothing but numpy."""

import math

import numpy as np

from .data import SceneData
from .description import Lamp, Loss

LEAST = 1e-3  # share of the rays into a hemisphere: at 32 samples a pixel, the first bounce meets the lamp in one pixel of thirty
DETAIL = "too small to be found by chance, and next-event estimation is off: its light becomes a few white dots"


def left_to_chance(scene: SceneData, nee: bool) -> tuple[Loss, ...]:
    """A Loss for each lamp that has a size but covers less than `LEAST` of the hemisphere, seen from the scene's middle.

    None with `nee`: next-event estimation finds them all.
    """
    if nee or not len(scene.triangles):
        return ()
    low, high = scene.bounds
    middle, radius = scene.origin + (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    return tuple(Loss(lamp.name, "", DETAIL) for lamp in scene.lamps if 0 < _share(lamp, middle, radius) < LEAST)


def _share(lamp: Lamp, middle: np.ndarray, radius: float) -> float:
    """Solid angle of a lamp over 2 pi, seen from the scene's middle, at least half its radius away; 0 if rays cannot hit it."""
    if not lamp.mis or (lamp.kind == "area" and not lamp.spread):
        return 0.0
    if lamp.kind == "sun":
        return 1 - math.cos(lamp.radius)
    area = lamp.width * lamp.height if lamp.kind == "area" else math.pi * lamp.radius**2
    distance = max(float(np.linalg.norm(np.array(lamp.to_world)[:3, 3] - middle)), radius / 2, 1e-9)
    return area / (2 * math.pi * distance**2)
