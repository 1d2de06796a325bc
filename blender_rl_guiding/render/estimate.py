"""How long a render will still take: samples take equally long, and so do training steps."""

from ..pace import Pace
from ..settings import Render
from .result import Result


def pace(state: Result, settings: Render) -> Pace:
    """The pace of a render under way.

    left = min(t_traced N_to_come / N_taken + t_learnt W_to_come / W_done, limit - t), with N samples of all pixels, W units of learning.
    The render itself finds N_to_come after each pass, see `noise.needed`.
    """
    # The last sample teaches nothing.
    learnt, to_learn = state.guide.work(state.taken, max(0, min(state.rounds, settings.spp - 1 - state.taken)))
    left = (state.seconds - state.learn_seconds) * state.ahead + (state.learn_seconds * to_learn / learnt if learnt else 0.0)
    if settings.seconds:
        left = min(left, max(0.0, settings.seconds - state.seconds))
    return Pace(state.seconds, left)
