"""The film's sums, variances, noise, passes and alpha equal NumPy's. Pixels have different numbers of samples."""

import numpy as np
import pytest

from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.kernels.sampling import vector
from blender_rl_guiding.render.film import ALPHA, DIRECT, EMISSION, PASSES, Film, add_sample

COUNTS = np.array([5, 2, 1, 0, 5, 3])  # samples of each pixel


@kernel
def add_samples(sums, pixels, radiance, weights, finite):
    for i in range(len(pixels)):
        finite[i] = add_sample(sums, pixels[i], vector(radiance, i), weights[i])


def add(film: Film, pixels, radiance, weights=None) -> np.ndarray:
    """Add samples (n, 3) to pixels (n,). Returns whether each is finite."""
    finite = np.empty(len(pixels), bool)
    weights = np.ones(len(pixels)) if weights is None else weights
    add_samples(film.sums, np.array(pixels, np.int64), np.array(radiance, np.float32), np.array(weights, np.float32), finite)
    return finite


def samples_of(counts: np.ndarray) -> list[np.ndarray]:
    """Random samples (count, 3) for each pixel."""
    rng = np.random.default_rng(1)
    return [rng.random((count, 3), np.float32) for count in counts]


def exposed(samples: list[np.ndarray], exposure: float = 1.0, passes: bool = False) -> Film:
    """A film of 3 x 2 pixels with these samples."""
    film = Film(width=3, height=2, exposure=exposure, passes=passes)
    for pixel, values in enumerate(samples):
        assert add(film, [pixel] * len(values), values).all()
    return film


@pytest.mark.parametrize("exposure", [1.0, 2.5])
def test_mean_and_variance_are_numpys(exposure):
    samples = samples_of(COUNTS)
    film = exposed(samples, exposure)
    assert film.samples == 5
    np.testing.assert_array_equal(film.counts, COUNTS.reshape(2, 3))
    assert film.mean().dtype == np.float32
    mean = [s.mean(axis=0) if len(s) else np.zeros(3) for s in samples]
    np.testing.assert_allclose(film.mean(), exposure * np.reshape(mean, (2, 3, 3)), rtol=1e-6)
    variance = [s.var(axis=0, ddof=1, dtype=float) / len(s) if len(s) > 1 else np.zeros(3) for s in samples]
    np.testing.assert_allclose(film.variance_of_mean(), exposure**2 * np.reshape(variance, (2, 3, 3)), rtol=1e-6, atol=1e-15)


def test_weighted_samples():
    """If the weights w are inverse variances, the mean has the variance 1 / sum w, and the film's estimate of it is unbiased."""
    rng, weights = np.random.default_rng(3), np.arange(1.0, 17.0)
    films = 4000
    film = Film(films, 1)
    values = 5 + rng.normal(size=(16, films, 3)) / np.sqrt(weights)[:, None, None]
    for weight, samples in zip(weights, values, strict=True):
        add(film, range(films), samples, np.full(films, weight))
    expected = np.average(values, axis=0, weights=weights)
    np.testing.assert_allclose(film.mean()[0], expected, rtol=1e-6)
    truth = 1 / weights.sum()
    estimates = film.variance_of_mean().ravel()
    # Each estimate has the relative spread sqrt(2 / 15) of a chi-squared variable. Limit: four standard errors, as below.
    assert estimates.mean() == pytest.approx(truth, rel=4 * np.sqrt(2 / 15 / estimates.size))
    assert film.mean()[0].var() == pytest.approx(truth, rel=4 * np.sqrt(2 / estimates.size))


def test_sums_do_not_lose_small_samples():
    film = Film(1, 1)
    add(film, [0] * 1001, np.concatenate([np.full((1, 3), 1e8), np.ones((1000, 3))]))
    assert film.mean()[0, 0, 0] == pytest.approx((1e8 + 1000) / 1001, rel=1e-7)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_told(value):
    radiance = np.ones((3, 3))
    radiance[1, 2] = value
    assert add(Film(3, 1), [0, 1, 2], radiance).tolist() == [True, False, True]


def test_noise_is_the_standard_error_over_the_root_of_the_brightness():
    samples = [s + 1 for s in samples_of(np.full(6, 50))]
    noise = exposed(samples).noise()
    error = [np.sqrt((s.var(axis=0, ddof=1) / len(s)).sum()) for s in samples]
    np.testing.assert_allclose(noise.ravel(), error / np.sqrt([s.mean(axis=0).sum() for s in samples]), rtol=1e-3)


def test_without_passes_there_are_no_layers():
    assert exposed(samples_of(COUNTS)).layers() == {}


@pytest.mark.parametrize("exposure", [1.0, 2.5])
def test_layers_are_means_and_what_is_light_is_exposed(exposure):
    film = exposed(samples_of(COUNTS), exposure, passes=True)
    film.sums.passes[:] = np.random.default_rng(2).random(film.sums.passes.shape)
    layers = film.layers()
    assert list(layers) == [*PASSES, "Indirect", "Variance", "Sample Count"]
    divisor = np.maximum(COUNTS, 1).reshape(2, 3, 1)
    for name, (first, count) in PASSES.items():
        expected = film.sums.passes[:, first : first + count].reshape(2, 3, count) / divisor
        expected = expected * (exposure if first in (EMISSION, DIRECT) else 1)
        np.testing.assert_allclose(layers[name].reshape(expected.shape), expected, rtol=1e-6, err_msg=name)
        assert layers[name].dtype == np.float32
    assert layers["Depth"].shape == layers["Sample Count"].shape == (2, 3)
    np.testing.assert_allclose(layers["Emission"] + layers["Direct"] + layers["Indirect"], film.mean(), atol=1e-6)
    np.testing.assert_array_equal(layers["Sample Count"], film.counts)
    np.testing.assert_allclose(layers["Variance"], film.variance_of_mean(), rtol=1e-6)


def test_alpha_is_the_share_that_did_not_see_the_world():
    film = exposed(samples_of(COUNTS), passes=True)
    film.sums.passes[:, ALPHA] = [0, 1, 1, 0, 2.5, 3]
    np.testing.assert_allclose(film.alpha(), [[1, 0.5, 0], [1, 0.5, 0]])
