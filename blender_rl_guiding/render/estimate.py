"""How far a render has come, and how long it will still take: samples take equally long, and so do training steps."""

from ..settings import DQN, Render
from .renderer import Result


def left(state: Result, settings: Render) -> float:
    """Seconds that remain: tracing and learning, each by what it took so far; no more than the time limit leaves."""
    samples = state.film.samples
    tracing = (state.seconds - state.learn_seconds) / samples * (settings.spp - samples)
    done, total = _learning(state, settings)
    learning = state.learn_seconds / done * max(0, total - done) if done else 0.0
    return min(tracing + learning, max(0.0, settings.seconds - state.seconds)) if settings.seconds else tracing + learning


def share(state: Result, settings: Render) -> float:
    """The share of the render's time that is behind us, 0..1."""
    return state.seconds / max(state.seconds + left(state, settings), 1e-9)


def _learning(state: Result, settings: Render) -> tuple[int, int]:
    """How much is learnt and how much there will be: steps of training, or samples to learn from. Nothing follows the last sample."""
    guide = settings.guide
    if isinstance(guide, DQN):
        return state.steps, min(guide.first_steps + max(0, settings.spp - 2) * guide.steps, guide.max_steps)
    return min(state.film.samples, settings.spp - 1), settings.spp - 1
