"""How long a render still takes: samples and training steps each at their own pace."""

import numpy as np
import pytest

from blender_rl_guiding.guiding import make_guide
from blender_rl_guiding.guiding.base import Guide
from blender_rl_guiding.render import Result
from blender_rl_guiding.render.estimate import left, share
from blender_rl_guiding.render.film import Film
from blender_rl_guiding.settings import BSDF, DQN, QTable, Render
from tests import scenes


class Working(Guide):
    """A guide that has learnt so much, and has so much to learn."""

    def __init__(self, done: int, to_come: int) -> None:
        self._work = done, to_come

    def work(self, taken: int, passes: int) -> tuple[int, int]:
        return self._work


def state(samples: int, seconds: float, learning: float = 0.0, guide: Guide | None = None) -> Result:
    return Result(Film(2, 2), guide or make_guide(BSDF(), scenes.tiny(2), 0), seconds, learning, samples)


@pytest.mark.parametrize(
    ("settings", "at", "expected"),
    [
        (Render(spp=32), state(8, 4.0), 12.0),
        (Render(spp=32, seconds=5.0), state(8, 4.0), 1.0),
        (Render(spp=11, guide=QTable()), state(1, 3.0, 2.0), 10 * 1.0 + 9 * 2.0),
        (Render(spp=11), state(1, 16.0, 15.0, Working(150, 330)), 10 * 1.0 + 330 * 0.1),
        (Render(spp=11), state(2, 4.0, 0.0, Working(0, 330)), 9 * 2.0),  # nothing is known of learning yet
        (Render(spp=11), state(11, 60.0, 48.0, Working(480, 0)), 0.0),
    ],
)
def test_seconds_that_remain(settings: Render, at: Result, expected: float):
    assert left(at, settings) == pytest.approx(expected)
    assert share(at, settings) == pytest.approx(at.seconds / (at.seconds + expected))


def test_the_share_is_told_within_a_training(monkeypatch: pytest.MonkeyPatch):
    from blender_rl_guiding.render import render, renderer

    monkeypatch.setattr(renderer, "TOLD_EVERY", 0.0)
    guide, told = DQN(layers=2, width=8, rows=3, columns=4, learning_starts=16, batch=16, first_steps=6, steps=2), []
    result = render(scenes.tiny(8), Render(spp=3, guide=guide), on_step=lambda found: told.append((found.film.samples, found.steps)))
    assert told == [(1, 1), (1, 2), (1, 3), (1, 4), (1, 5), (1, 6), (2, 7), (2, 8)]
    assert 0 < result.learn_seconds < result.seconds
    assert np.isfinite(result.image).all()
