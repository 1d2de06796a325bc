"""What a guide is to the renderer: it hands out directions for a pass, and learns from what the pass saw."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..memory import Part
from ..scene.data import SceneData
from .directions import UNKNOWN, one_cell
from .saved import Arrays, Saved


class Transitions(NamedTuple):
    """(s, a, r, s') of path segments x -> y, in structure of arrays, in the order of pixels, samples and vertices.

    The light that arrives at x through the segment is estimated as reward + albedo / pi * (integral of what arrives at y times cosine).
    """

    position: np.ndarray  # (n, 3) float32, x, from the scene's origin
    normal: np.ndarray  # (n, 3) float32, shading normal at x
    direction: np.ndarray  # (n, 3) float32, unit, from x to y
    next_position: np.ndarray  # (n, 3) float32, y; where terminal anything
    next_normal: np.ndarray  # (n, 3) float32
    reward: np.ndarray  # (n,) float32, luminance: emission of y times its MIS weight, plus the NEE estimate at y
    albedo: np.ndarray  # (n,) float32, luminance of y's albedo; 0 where y ends the path


TRANSITION = 68  # bytes of one

OnStep = Callable[[int], None]  # called after each training step, with the number of steps so far


def unheard(steps: int) -> None:
    """An `OnStep` that does nothing."""


class Learnt(NamedTuple):
    """What a guide knows at a point, over equal patches of the hemisphere around the normal; row 0 is at the horizon."""

    radiance: np.ndarray  # (rows, columns) float32, mean that arrives through each
    chances: np.ndarray  # (rows, columns) float32, probability of drawing each


class Guide:
    """Proposes directions; as it stands, the material's own, and it never learns. A wrong guide costs variance, never bias.

    The module `guiding.<kind>` calls its subclass GUIDE. Nobody else asks for a guide's type.
    """

    def __init__(self, settings: Any, scene: SceneData, seed: int) -> None:
        """The guide before its first lesson. `settings` are of the class whose kind names the module."""

    @classmethod
    def memory(cls, settings: Any, scene: SceneData, visits: float, rough: bool) -> list[Part]:
        """The parts of memory that the guide will take, beside the transitions of a pass.

        visits: transitions that it will have learnt from in the end, about. rough: return at least the true size, without a look at
        any surface; `visits` bounds the number of cells.
        """
        return []

    def directions(self) -> Any:
        """The directions of the next pass: the named tuple of their kind. They must not change until `learn` is called."""
        return one_cell(bsdf_fraction=1.0)

    def wanted(self) -> int:
        """How many transitions of the next pass to collect, about; 0 for none."""
        return 0

    def learn(self, transitions: Transitions, on_step: OnStep = unheard) -> dict[str, Any]:
        """Learn from a pass; returns numbers for the pass's entry in the learning curve.

        Numbers that others read, each of which may be missing: "loss", the mean over the pass; "losses", a list with one of each training
        step, unless the pass was the step; "train_seconds"; "infer_seconds", for laying out directions of the next pass.
        """
        return {}

    def work(self, taken: int, passes: int) -> tuple[int, int]:
        """Units of learning that are done, and that are to come: they take equally long. By default a unit is a pass.

        taken: samples of each pixel so far. passes: those to come from which the guide learns.
        """
        return taken, passes

    def states(self, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """The number of the state, such as a cell, that each point belongs to: (n,) int32 from (n, 3) float32; UNKNOWN where none."""
        return np.full(len(position), UNKNOWN, np.int32)

    def learnt(self, position: np.ndarray, normal: np.ndarray) -> Learnt | None:
        """What is known at a point, from (3,) float32 each; None where nothing is."""
        return None

    def state(self) -> Arrays:
        """All that learning has changed, for a checkpoint: views rather than copies, and nothing that follows from the rest."""
        return {}

    def restore(self, saved: Saved) -> None:
        """Become the guide whose state was saved, with the same bits to come. Called before anything is learnt.

        The file may be anyone's: ValueError where the state cannot be one of a guide with these settings. Numbers may be nonsense, but no
        kernel may be led to read outside of an array.
        """


def empty_transitions(count: int) -> Transitions:
    """Room for `count` transitions."""
    a, b, c, d, e = (np.zeros((count, 3), np.float32) for _ in range(5))
    return Transitions(a, b, c, d, e, np.zeros(count, np.float32), np.zeros(count, np.float32))
