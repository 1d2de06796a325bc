"""The progress of a render: its share grows to 1, and the estimate of the seconds left is right, for all limits that end it."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from blender_rl_guiding.guiding import make_guide
from blender_rl_guiding.guiding.base import Guide
from blender_rl_guiding.pace import Pace
from blender_rl_guiding.render import Result, render, renderer
from blender_rl_guiding.render.film import Film
from blender_rl_guiding.render.noise import LEAST_SAMPLES, needed
from blender_rl_guiding.render.result import pace
from blender_rl_guiding.settings import BSDF, DQN, QTable, Render
from tests import scenes


class Working(Guide):
    """A guide with given units of learning: (done, to come)."""

    def __init__(self, done: int, to_come: int) -> None:
        self._work = done, to_come

    def work(self, taken: int, passes: int) -> tuple[int, int]:
        return self._work


def state(settings: Render, samples: int, seconds: float, learning: float = 0.0, guide: Guide | None = None) -> Result:
    more = settings.spp - samples
    guide = guide or make_guide(BSDF(), scenes.tiny(2), 0)
    return Result(Film(2, 2), guide, seconds, learning, samples, ahead=more / samples, rounds=more)


@pytest.mark.parametrize(
    ("settings", "at", "expected"),
    [
        (Render(spp=32), (8, 4.0), 12.0),
        (Render(spp=32, seconds=5.0), (8, 4.0), 1.0),
        (Render(spp=32, seconds=5.0), (8, 6.0), 0.0),
        (Render(spp=11, guide=QTable()), (1, 3.0, 2.0), 10 * 1.0 + 9 * 2.0),
        (Render(spp=11), (1, 16.0, 15.0, Working(150, 330)), 10 * 1.0 + 330 * 0.1),  # in the middle of training
        (Render(spp=11), (2, 4.0, 0.0, Working(0, 330)), 9 * 2.0),  # nothing to learn from yet
        (Render(spp=11), (11, 60.0, 48.0, Working(480, 0)), 0.0),
    ],
)
def test_seconds_that_remain(settings: Render, at: tuple, expected: float):
    found = pace(state(settings, *at), settings)
    assert found.left == pytest.approx(expected)
    assert found.share == pytest.approx(found.seconds / (found.seconds + expected))


# --- noise -----------------------------------------------------------------------------------------------------------


def film(variance: np.ndarray, samples: int) -> Film:
    """A film of mean brightness 1. variance: its estimates of the variance of one sample."""
    made = Film(*variance.shape[::-1])
    made.sums.samples[:], made.sums.weight[:] = samples, samples
    made.sums.sum[:] = samples / 3
    spread = variance.reshape(-1, 1) / 3 * (samples - 1) / samples
    made.sums.squares[:] = samples * (1 / 9 + spread)
    return made


def test_the_noise_falls_with_the_root_of_the_samples():
    variance = np.full((9, 9), 1e-9)
    variance[4, 4] = 4.0
    limit = 2 / 10 / (1 + 1e-4)  # 100 samples reach this limit
    more = needed(film(variance, 25), Render(spp=1000, noise=limit), 25)
    assert (more > 0).sum() == 9
    np.testing.assert_allclose(more[3:6, 3:6], 75, atol=1)
    assert not needed(film(variance, 101), Render(spp=1000, noise=limit), 101).any()
    assert needed(film(variance, 25), Render(spp=30, noise=limit), 25).max() == 5
    assert not needed(film(variance, 30), Render(spp=30, noise=limit), 30).any()


def test_each_pixel_gets_the_least_samples():
    quiet = film(np.full((3, 3), 1e-9), 4)
    assert (needed(quiet, Render(spp=100, noise=0.5), 4) == LEAST_SAMPLES - 4).all()
    assert (needed(quiet, Render(spp=10, noise=0.5), 4) == 6).all()


# --- whole renders ---------------------------------------------------------------------------------------------------


class Clock:
    """A clock that advances by LOOK when it is read, and by a thousandth of a second for each traced sample."""

    LOOK = 0.002  # a training step reads the clock once, so it takes this time

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 0.0
        trace = renderer.PassTracer.trace

        def traced(*given, **named):
            (seen,) = (value for value in (*given, *named.values()) if isinstance(value, Film))
            before = seen.counts.sum()
            found = trace(*given, **named)
            self.now += 0.001 * float(seen.counts.sum() - before)
            return found

        monkeypatch.setattr(renderer.PassTracer, "trace", traced)
        monkeypatch.setattr(renderer, "time", SimpleNamespace(perf_counter=self.look))

    def look(self) -> float:
        self.now += self.LOOK
        return self.now


GUIDES = {
    "bsdf": BSDF(),
    "qtable": QTable(rows=3, columns=4, cells=4, recorded=500),
    "dqn": DQN(layers=2, width=8, rows=3, columns=4, cells=4, learning_starts=16, batch=16, first_steps=30, steps=2),
}
SAMPLES, SECONDS, NOISE = (24, 200), (0.0, 8.0), (0.0, 0.05, 0.2)


@pytest.mark.parametrize(("guide", "spp", "seconds", "noise"), [*itertools.product(GUIDES, SAMPLES, SECONDS, NOISE)])
def test_the_share_grows_to_1_and_the_seconds_are_right(guide: str, spp: int, seconds: float, noise: float, monkeypatch):
    settings, paces = Render(spp=spp, seconds=seconds, noise=noise, guide=GUIDES[guide], nee=False), []

    def told(found: Result) -> None:
        paces.append(pace(found, settings))

    Clock(monkeypatch)
    result = render(scenes.tiny(10), settings, on_pass=told, on_step=told)
    shares = [found.share for found in paces]
    half = min(paces, key=lambda found: abs(found.seconds - result.seconds / 2))
    true = result.seconds - half.seconds
    assert paces[-1] == Pace(result.seconds, 0.0)
    assert all(later > share - 0.1 for share, later in itertools.pairwise(shares))
    assert true / 1.5 < half.left < true * 1.5


def test_the_share_is_told_within_a_training(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(renderer, "TOLD_EVERY", 0.0)
    guide, told = DQN(layers=2, width=8, rows=3, columns=4, learning_starts=16, batch=16, first_steps=6, steps=2), []
    result = render(scenes.tiny(8), Render(spp=3, guide=guide), on_step=lambda found: told.append((found.film.samples, found.steps)))
    assert told == [(1, 1), (1, 2), (1, 3), (1, 4), (1, 5), (1, 6), (2, 7), (2, 8)]
    assert 0 < result.learn_seconds < result.seconds
    assert np.isfinite(result.image).all()
