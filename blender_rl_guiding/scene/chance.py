"""Finds lamps so small that rays rarely meet them. Without light sampling such a lamp gives a few white dots. Needs only numpy."""

import math

import numpy as np

from .data import SceneData
from .description import Lamp, Loss

LEAST = 1e-3  # share of the hemisphere: at 32 samples per pixel, the first bounce meets such a lamp in one pixel of thirty
DETAIL = "too small to be found by chance, and next-event estimation is off: its light becomes a few white dots"


def left_to_chance(scene: SceneData, nee: bool) -> tuple[Loss, ...]:
    """A Loss for each lamp with a size that covers less than `LEAST` of the hemisphere, seen from the scene's middle.

    Empty with `nee`, because next-event estimation finds all lamps.
    """
    if nee or not len(scene.triangles):
        return ()
    low, high = scene.bounds
    middle, radius = scene.origin + (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    return tuple(Loss(lamp.name, "", DETAIL) for lamp in scene.lamps if 0 < _share(lamp, middle, radius) < LEAST)


def _share(lamp: Lamp, middle: np.ndarray, radius: float) -> float:
    """Solid angle of a lamp / 2 pi, seen from the scene's middle. 0 if rays cannot hit the lamp.

    The distance counts as at least half the scene's radius.
    """
    if not lamp.mis or (lamp.kind == "area" and not lamp.spread):
        return 0.0
    if lamp.kind == "sun":
        return 1 - math.cos(lamp.radius)
    area = lamp.width * lamp.height if lamp.kind == "area" else math.pi * lamp.radius**2
    distance = max(float(np.linalg.norm(np.array(lamp.to_world)[:3, 3] - middle)), radius / 2, 1e-9)
    return area / (2 * math.pi * distance**2)
