"""The interface of a guide: it gives the directions of a pass, then learns from the transitions of the pass."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..memory import Part
from ..scene.data import SceneData
from .directions import UNKNOWN, one_cell
from .saved import Arrays, Saved


class Transitions(NamedTuple):
    """Transitions (s, a, r, s') of path segments x -> y, as a structure of arrays, ordered by pixel, sample and vertex.

    The estimate of L_i(x, from y), a luminance, is reward + albedo / pi * integral of L_i(y, w) cos(theta) dw over the hemisphere at y.
    """

    position: np.ndarray  # (n, 3) float32, x, from the scene's origin
    normal: np.ndarray  # (n, 3) float32, shading normal at x
    direction: np.ndarray  # (n, 3) float32, unit, from x to y
    next_position: np.ndarray  # (n, 3) float32, y; any value where the path ends
    next_normal: np.ndarray  # (n, 3) float32
    reward: np.ndarray  # (n,) float32, luminance: emission of y times its MIS weight, plus the NEE estimate at y
    albedo: np.ndarray  # (n,) float32, luminance of y's albedo; 0 where y ends the path


TRANSITION = 68  # bytes of one transition

OnStep = Callable[[int], None]  # called after each training step, with the number of steps so far


def unheard(steps: int) -> None:
    """An `OnStep` that does nothing."""


class Learnt(NamedTuple):
    """A guide's estimates at a point, for equal patches of the hemisphere around the normal. Row 0 is at the horizon."""

    radiance: np.ndarray  # (rows, columns) float32, mean incident radiance through each patch, luminance
    chances: np.ndarray  # (rows, columns) float32, probability of drawing each patch


class Guide:
    """Proposes directions. A wrong guide costs variance, never bias.

    This base class leaves directions to the material, and never learns. The module `guiding.<kind>` names its subclass GUIDE. No other
    code asks for the type of a guide.
    """

    def __init__(self, settings: Any, scene: SceneData, seed: int) -> None:
        """The guide before it has learnt. `settings`: the settings class of the same kind as the module."""

    @classmethod
    def memory(cls, settings: Any, scene: SceneData, visits: float, rough: bool) -> list[Part]:
        """The parts of memory that the guide will take, without the transitions of a pass.

        visits: about how many transitions the guide learns from in the whole render. rough: return an upper bound, without reading
        any surface; `visits` bounds the number of cells.
        """
        return []

    def directions(self) -> Any:
        """The directions of the next pass, of a kind that `mixture.declare` knows. Their arrays must not change until `learn` is called."""
        return one_cell(bsdf_fraction=1.0)

    def wanted(self) -> int:
        """About how many transitions to collect in the next pass; 0 for none."""
        return 0

    def learn(self, transitions: Transitions, on_step: OnStep = unheard) -> dict[str, Any]:
        """Learn from a pass. Returns numbers for the pass's entry in the learning curve.

        Other code reads these; each may be missing: "loss", mean over the pass; "losses", a list, one loss for each training step, missing
        if the whole pass is one step; "train_seconds"; "infer_seconds", the time to compute the directions of the next pass.
        """
        return {}

    def work(self, taken: int, passes: int) -> tuple[int, int]:
        """(units of learning done, units to come). All units take equally long. By default a unit is a pass.

        taken: samples of each pixel so far. passes: the number of passes to come from which the guide learns.
        """
        return taken, passes

    def states(self, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """The state of each point, such as its cell, as a number: (n,) int32 from (n, 3) float32 each. UNKNOWN where there is none."""
        return np.full(len(position), UNKNOWN, np.int32)

    def learnt(self, position: np.ndarray, normal: np.ndarray) -> Learnt | None:
        """The guide's estimates at a point, from (3,) float32 each; None where the guide has none."""
        return None

    def state(self) -> Arrays:
        """All that learning has changed, for a checkpoint: views, not copies. It leaves out arrays that can be computed from others."""
        return {}

    def restore(self, saved: Saved) -> None:
        """Take a saved state. The guide then computes the same bits as the saved guide would. Called before the guide learns.

        Anyone may have made the file: ValueError if no guide with these settings can have this state. Its numbers may be nonsense, but they
        must not make a kernel read outside of an array.
        """


def empty_transitions(count: int) -> Transitions:
    """Room for `count` transitions."""
    a, b, c, d, e = (np.zeros((count, 3), np.float32) for _ in range(5))
    return Transitions(a, b, c, d, e, np.zeros(count, np.float32), np.zeros(count, np.float32))
