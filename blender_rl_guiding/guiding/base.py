"""What a guide is to the renderer: it hands out directions for a pass, and learns from what the pass saw."""

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

from .directions import Directions
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
    reward: np.ndarray  # (n,) float32, luminance: what y emits to x, and with NEE only what NEE leaves, plus y's light by NEE
    albedo: np.ndarray  # (n,) float32, luminance of y's albedo; 0 where y ends the path


OnStep = Callable[[int], None]  # is told how many training steps there have been, after each


def unheard(steps: int) -> None:
    """The `OnStep` of whoever does not want to know."""


class Guide(Protocol):
    """Anything that proposes directions. A guide may be as wrong as it likes: that costs variance, never bias."""

    def directions(self) -> Directions:
        """The directions of the next pass; must not change until `learn` is called."""
        ...

    def wanted(self) -> int:
        """How many transitions of the next pass to collect, about; 0 for a guide that does not learn."""
        ...

    def learn(self, transitions: Transitions, on_step: OnStep = unheard) -> dict[str, Any]:
        """Learn from a pass; returns numbers for the pass's entry in the learning curve, and "losses", a list, which may be missing.

        "loss": the mean over the pass; "losses": one of each training step, unless the pass was the step; "train_seconds" and
        "infer_seconds": how long training took, and laying out directions for the next pass.
        """
        ...

    def state(self) -> Arrays:
        """All that learning has changed, for a checkpoint: views rather than copies, and nothing that follows from the rest."""
        ...

    def restore(self, saved: Saved) -> None:
        """Become the guide whose state was saved, with the same bits to come. Called before anything is learnt.

        The file may be anyone's: ValueError where the state cannot be one of a guide with these settings. Numbers may be nonsense, but no
        kernel may be led to read outside of an array.
        """
        ...


def empty_transitions(count: int) -> Transitions:
    """Room for `count` transitions."""
    a, b, c, d, e = (np.zeros((count, 3), np.float32) for _ in range(5))
    return Transitions(a, b, c, d, e, np.zeros(count, np.float32), np.zeros(count, np.float32))
