"""The state of a render, on its way and at its end, and the time that it still takes."""

from dataclasses import dataclass, field

import numpy as np

from ..guiding.base import Guide
from ..pace import Pace
from ..settings import Render
from .film import Film


@dataclass
class Result:
    """The state of a render. After an interrupt, `film` also holds a part of the samples of the pass under way."""

    film: Film
    guide: Guide  # as far as it has learnt
    seconds: float = 0.0  # wall time of tracing and learning
    learn_seconds: float = 0.0
    taken: int = 0  # samples of each pixel, but for those that were not noisy any more
    ahead: float = 0.0  # samples of all pixels to come, for each that is taken, see `noise.needed`
    rounds: int = 0  # samples to come of the pixel that needs most
    steps: int = 0  # of training
    rays: int = 0  # closest-hit and shadow rays
    vertices_per_path: float = 0.0  # of the last pass
    curve: list[dict[str, float]] = field(default_factory=list)  # one entry a pass: samples, seconds, loss, ...
    losses: list[float] = field(default_factory=list)  # one for each training step
    finished: bool = False  # whether it ended as its settings say

    @property
    def image(self) -> np.ndarray:
        """(height, width, 3) float32, linear, top row first."""
        return self.film.mean()


def pace(state: Result, settings: Render) -> Pace:
    """How far a render under way has come. Samples take equally long, and so do training steps.

    left = min(t_traced N_to_come / N_taken + t_learnt W_to_come / W_done, limit - t), with N samples of all pixels, W units of learning.
    The render itself finds N_to_come after each pass, see `noise.needed`.
    """
    # The last sample teaches nothing.
    learnt, to_learn = state.guide.work(state.taken, max(0, min(state.rounds, settings.spp - 1 - state.taken)))
    left = (state.seconds - state.learn_seconds) * state.ahead
    if learnt:
        left += state.learn_seconds * to_learn / learnt
    if settings.seconds:
        left = min(left, max(0.0, settings.seconds - state.seconds))
    return Pace(state.seconds, left)
