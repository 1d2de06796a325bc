"""How far a render has come, and how long it will still take: samples take equally long, and so do training steps."""

from ..settings import Render
from .result import Result


def left(state: Result, settings: Render) -> float:
    """Seconds that remain: tracing and learning, each by what it took so far; no more than the time limit leaves."""
    samples = state.taken
    tracing = (state.seconds - state.learn_seconds) / samples * (settings.spp - samples)
    done, to_do = _learning(state, settings)
    seconds = tracing + (state.learn_seconds / done * to_do if done else 0.0)
    return min(seconds, max(0.0, settings.seconds - state.seconds)) if settings.seconds else seconds


def share(state: Result, settings: Render) -> float:
    """The share of the render's time that is behind us, 0..1."""
    return state.seconds / max(state.seconds + left(state, settings), 1e-9)


def _learning(state: Result, settings: Render) -> tuple[int, int]:
    """Units of learning that are done, and that are to come. Nothing is learnt from the last pass."""
    return state.guide.work(state.taken, max(0, settings.spp - 1 - state.taken))
