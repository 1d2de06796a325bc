"""The state of a render, while it runs and at its end, and an estimate of the time left."""

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
    guide: Guide  # as trained so far
    seconds: float = 0.0  # wall time of tracing and learning
    learn_seconds: float = 0.0
    taken: int = 0  # samples of each pixel; pixels below the noise limit have fewer
    ahead: float = 0.0  # samples to come / samples taken, each summed over all pixels, see `noise.needed`
    rounds: int = 0  # samples to come of the pixel that needs the most
    steps: int = 0  # of training, so far
    rays: int = 0  # closest-hit and shadow rays
    vertices_per_path: float = 0.0  # of the last pass
    curve: list[dict[str, float]] = field(default_factory=list)  # one entry a pass: samples, seconds, loss, ...
    losses: list[float] = field(default_factory=list)  # one for each training step
    finished: bool = False  # whether the render ended by its settings, not by an interrupt

    @property
    def image(self) -> np.ndarray:
        """(height, width, 3) float32, linear, top row first."""
        return self.film.mean()


def pace(state: Result, settings: Render) -> Pace:
    """The progress of a render: seconds so far, and seconds left if all samples take equally long, and all units of learning do.

    left = min(t_traced N_to_come / N_taken + t_learnt W_to_come / W_done, limit - t), in seconds.
    N: samples, summed over all pixels. W: units of learning. The render computes N_to_come after each pass, by `noise.needed`.
    """
    # Guides do not learn from the last sample.
    learnt, to_learn = state.guide.work(state.taken, max(0, min(state.rounds, settings.spp - 1 - state.taken)))
    left = (state.seconds - state.learn_seconds) * state.ahead
    if learnt:
        left += state.learn_seconds * to_learn / learnt
    if settings.seconds:
        left = min(left, max(0.0, settings.seconds - state.seconds))
    return Pace(state.seconds, left)
