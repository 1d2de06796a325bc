"""How long a render will still take: samples take equally long, and so do training steps."""

from ..pace import Pace
from ..settings import DQN, Render
from .result import Result


def pace(state: Result, settings: Render) -> Pace:
    """The pace of a render under way.

    left = min(t_traced N_to_come / N_taken + t_learnt W_to_come / W_done, limit - t), with N samples of all pixels, W units of learning.
    The render itself finds N_to_come after each pass, see `noise.needed`.
    """
    learnt, to_learn = _learning(state, settings, passes=max(0, min(state.rounds, settings.spp - 1 - state.taken)))
    left = (state.seconds - state.learn_seconds) * state.ahead + (state.learn_seconds * to_learn / learnt if learnt else 0.0)
    if settings.seconds:
        left = min(left, max(0.0, settings.seconds - state.seconds))
    return Pace(state.seconds, left)


def _learning(state: Result, settings: Render, passes: int) -> tuple[int, int]:
    """Units of learning that are done, and that `passes` more will do: steps of training, or passes. The last sample teaches nothing."""
    guide = settings.guide
    if not isinstance(guide, DQN):
        return state.taken, passes
    return state.steps, min(max(0, guide.first_steps - state.steps) + passes * guide.steps, guide.max_steps - state.steps)
