"""Statistical tests. Each test has a false-alarm rate of 1e-4 for all its values together."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import stats

ALARM = 1e-4  # probability that correct code fails at a new seed; seeds are fixed, so a test that passed once passes again
TINY = 1e-300
ROUNDING = 2e-5  # relative error of some hundred operations in single precision
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)


def assert_distributed(observed: np.ndarray, expected: np.ndarray) -> None:
    """Pearson's chi-squared test of counts against expected counts of the same shape. Bins with fewer than 10 expected are pooled."""
    observed, expected = np.ravel(observed).astype(float), np.ravel(expected).astype(float)
    np.testing.assert_allclose(
        observed.sum(), expected.sum(), rtol=1e-4, err_msg="samples lie outside the bins, or the pdf is not one in all"
    )
    assert observed[expected == 0].sum() == 0, "a sample where the pdf is zero"
    rare = expected < 10
    observed, expected = (np.append(x[~rare], x[rare].sum()) for x in (observed, expected))
    observed, expected = observed[expected > 0], expected[expected > 0]
    if len(expected) == 1:  # all samples are in one bin, and the sums agree
        return
    statistic = ((observed - expected) ** 2 / expected).sum()
    p = stats.chi2.sf(statistic, len(expected) - 1)
    assert p > ALARM, f"chi-squared {statistic:.1f} in {len(expected)} bins: p = {p:.2g}"


def assert_uniform(samples: np.ndarray, bins: int) -> None:
    """Chi-squared test, in bins^d cells, that samples (n, d) are uniform in the unit cube."""
    assert samples.min() >= 0
    assert samples.max() <= 1
    counts, _ = np.histogramdd(samples, bins=[np.linspace(0, 1, bins + 1)] * samples.shape[1])
    assert_distributed(counts, np.full(counts.shape, len(samples) / counts.size))


def assert_means(mean: np.ndarray, variance: np.ndarray, truth: np.ndarray | float) -> None:
    """z-test of all means together against the truth. Means are independent, each over many samples.

    A bias of `detectable(variance)` in one value is detected nine times in ten.
    """
    mean, variance, truth = np.broadcast_arrays(np.asarray(mean, float), variance, truth)
    assert (variance > 0).all(), "a mean without spread: compare it directly"
    z = (mean - truth) / np.sqrt(variance)
    limit = _limit(z.size)
    worst = np.unravel_index(np.abs(z).argmax(), z.shape)
    assert abs(z[worst]) < limit, (
        f"value {worst} is {mean[worst]:.5g}, should be {truth[worst]:.5g}: {z[worst]:+.1f} sigma, limit {limit:.1f}"
    )


def detectable(variance: np.ndarray) -> np.ndarray:
    """The bias that `assert_means` detects nine times in ten, for each mean."""
    return (_limit(np.size(variance)) + stats.norm.isf(0.1)) * np.sqrt(variance)


def _limit(count: int) -> float:
    return float(stats.norm.isf(ALARM / 2 / count))


def hemisphere_counts(directions: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """Counts of (n, 3) directions in equal parts of cos(theta) in [0, 1] and phi in [0, 2 pi): (rows, columns)."""
    phi = np.arctan2(directions[:, 1], directions[:, 0]) % (2 * np.pi)
    edges = np.linspace(0, 1, rows + 1), np.linspace(0, 2 * np.pi, columns + 1)
    return np.histogram2d(directions[:, 2].clip(0, 1), phi, bins=edges)[0]


def hemisphere_masses(pdf: Callable[[np.ndarray], np.ndarray], rows: int, columns: int) -> np.ndarray:
    """The integral of a pdf per solid angle over each part of `hemisphere_counts`, by Gauss-Legendre quadrature."""
    z = _nodes(rows, 1.0)
    phi = _nodes(columns, 2 * np.pi)
    z, phi = np.broadcast_arrays(z[:, None], phi[None, :])
    r = np.sqrt(1 - z * z)
    directions = np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)
    values = pdf(directions.reshape(-1, 3).astype(np.float32)).reshape(rows, len(NODES), columns, len(NODES))
    return np.einsum("ijkl,j,l->ik", values.astype(float), WEIGHTS / 2 / rows, WEIGHTS * np.pi / columns)


def _nodes(parts: int, length: float) -> np.ndarray:
    """Quadrature nodes in each of the equal parts of [0, length], one after another."""
    return ((np.arange(parts)[:, None] + (NODES + 1) / 2) * length / parts).ravel()


@dataclass(frozen=True)
class Estimate:
    """Independent means, the estimated variance of each mean, and the degrees of freedom of each variance: arrays of equal shape."""

    mean: np.ndarray
    variance: np.ndarray
    freedom: np.ndarray

    def channels(self, count: int) -> "Estimate":
        """The first `count` along the last axis."""
        return Estimate(*(array[..., :count] for array in (self.mean, self.variance, self.freedom)))

    def joined(self, other: "Estimate") -> "Estimate":
        """This estimate, then the other one, along the first axis."""
        pairs = (self.mean, other.mean), (self.variance, other.variance), (self.freedom, other.freedom)
        return Estimate(*(np.concatenate(pair) for pair in pairs))


def pooled(image: Estimate, group: np.ndarray) -> Estimate:
    """Means (groups, channels) over pixels with equal numbers in `group` (pixels,). Degrees of freedom by Satterthwaite's formula."""
    count = np.bincount(group)[:, None]

    def total(array: np.ndarray) -> np.ndarray:
        flat = array.reshape(len(group), -1)
        return np.stack([np.bincount(group, channel) for channel in flat.T], axis=1)

    variance, doubt = total(image.variance), total(image.variance**2 / image.freedom)
    return Estimate(total(image.mean) / count, variance / count**2, variance**2 / np.maximum(doubt, TINY))


def assert_same(ours: Estimate, theirs: Estimate) -> None:
    """Welch's t-test: two sets of means (N, channels) are equal, all together. The last row is the mean of the whole image."""
    error, freedom = _welch(ours, theirs)
    t = (ours.mean - theirs.mean) / error
    p = 2 * stats.t.sf(np.abs(t), freedom) * t.size
    worst = tuple(int(i) for i in np.unravel_index(p.argmin(), p.shape))
    whole = ", ".join(
        f"{o / max(c, TINY) - 1:+.2%} +- {e / max(c, TINY):.2%}" for o, c, e in zip(ours.mean[-1], theirs.mean[-1], error[-1], strict=True)
    )
    assert p[worst] > ALARM, (
        f"{(p < ALARM).sum()} of {t.size} values differ, the most {worst}: {ours.mean[worst]:.5g} instead of {theirs.mean[worst]:.5g}, "
        f"{t[worst]:+.1f} sigma; the whole image by {whole}"
    )


def detectable_difference(ours: Estimate, theirs: Estimate) -> np.ndarray:
    """The difference that `assert_same` detects nine times in ten, for each pair of means."""
    error, freedom = _welch(ours, theirs)
    return (stats.t.isf(ALARM / 2 / error.size, freedom) + stats.norm.isf(0.1)) * error


def _welch(ours: Estimate, theirs: Estimate) -> tuple[np.ndarray, np.ndarray]:
    """(standard error of the difference, degrees of freedom). The error includes ROUNDING."""
    variance = ours.variance + theirs.variance
    doubt = ours.variance**2 / np.maximum(ours.freedom, 1) + theirs.variance**2 / np.maximum(theirs.freedom, 1)
    freedom = np.maximum(variance**2 / np.maximum(doubt, TINY), 1)
    scale = np.maximum(np.abs(theirs.mean), np.abs(theirs.mean[-1]))  # rounding errors of bright pixels also affect dark pixels
    return np.sqrt(variance + (ROUNDING * np.maximum(scale, ROUNDING)) ** 2), freedom
