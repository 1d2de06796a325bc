"""The film's sums, variances and refusals, and that an interrupt never leaves half a sample on it."""

import signal

import numpy as np
import pytest

from blender_rl_guiding.render.film import Film


def test_mean_and_variance_are_numpys():
    samples = np.random.default_rng(1).random((5, 2, 3, 3), np.float32)  # sample, row, column, channel
    film = Film(width=3, height=2)
    film.add(samples[:2].reshape(-1, 3))
    film.add(samples[2:].reshape(-1, 3))
    assert film.samples == 5
    assert film.mean().dtype == np.float32
    np.testing.assert_allclose(film.mean(), samples.mean(axis=0), rtol=1e-6)
    np.testing.assert_allclose(film.variance_of_mean(), samples.var(axis=0, ddof=1, dtype=float) / 5, rtol=1e-6)


def test_sums_do_not_lose_small_samples():
    film = Film(1, 1)
    film.add(np.full((1, 3), 1e8, np.float32))
    film.add(np.full((1000, 3), 1, np.float32))
    assert film.mean()[0, 0, 0] == pytest.approx((1e8 + 1000) / 1001, rel=1e-7)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_refused_by_pixel(value):
    radiance = np.zeros((2 * 6, 3), np.float32)
    radiance[6 + 4, 1] = value
    with pytest.raises(FloatingPointError, match=r"pixel \(1, 1\) received radiance \[ *0\. +(nan|-?inf) +0\. *\]"):
        Film(width=3, height=2).add(radiance)


def test_an_interrupt_leaves_whole_samples():
    ones = np.ones((1000 * 1000, 3), np.float32)
    for after in np.linspace(0.01, 0.04, 12):
        film = Film(1000, 1000)
        with pytest.raises(KeyboardInterrupt):
            interrupt(film, ones, after)
        assert film.samples == 0 or (film.mean() == 1).all()


def interrupt(film: Film, radiance: np.ndarray, after: float) -> None:
    """Add samples until Ctrl-C comes, most likely in the midst of adding."""
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, after)
    try:
        while True:
            film.add(radiance)
    finally:
        signal.signal(signal.SIGALRM, before)
