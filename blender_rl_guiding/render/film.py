"""The film: sums over the samples of each pixel."""

from typing import NamedTuple

import numpy as np

from ..guiding.saved import Arrays, Saved
from ..kernels import part
from ..kernels.sampling import F
from ..layers import LAYERS

BRIGHTEST = float(np.finfo(np.float32).max)

# The first column of each pass. Passes are summed besides the radiance.
ALPHA, DEPTH, ALBEDO, SHADING_NORMAL, POSITION, EMISSION, DIRECT, PASS_COLUMNS = 0, 1, 2, 5, 8, 11, 14, 17
_FIRST = {"Albedo": ALBEDO, "Normal": SHADING_NORMAL, "Depth": DEPTH, "Position": POSITION, "Emission": EMISSION, "Direct": DIRECT}
# The passes that are layers of the result: name -> (first column, number of columns).
PASSES = {name: (first, len(LAYERS[name])) for name, first in _FIRST.items()}


class Sums(NamedTuple):
    """The sums that kernels add to."""

    sum: np.ndarray  # (pixels, 3) float64, linear RGB times weight
    squares: np.ndarray  # (pixels, 3) float64, squares times weight
    samples: np.ndarray  # (pixels,) int64, number of samples
    weight: np.ndarray  # (pixels,) float64, sum of the samples' weights
    passes: np.ndarray  # (pixels, PASS_COLUMNS) float32, or (0, ...)


class Film:
    """For each pixel: the sums over its samples (`Sums`), in double precision, and the sums of the passes, if they are wanted.

    The film takes 64 bytes per pixel, and 132 with passes.
    """

    def __init__(self, width: int, height: int, exposure: float = 1.0, passes: bool = False) -> None:
        self.shape = (height, width, 3)
        self._exposure = exposure
        pixels = width * height
        passed = np.zeros((pixels if passes else 0, PASS_COLUMNS), np.float32)
        self.sums = Sums(np.zeros((pixels, 3)), np.zeros((pixels, 3)), np.zeros(pixels, np.int64), np.zeros(pixels), passed)

    def state(self) -> Arrays:
        """The sums, for a checkpoint: the arrays themselves, not copies."""
        return self.sums._asdict()

    def restore(self, saved: Saved, most: int) -> None:
        """Take a saved `state`. ValueError if no film of this size with at most `most` samples per pixel can have this state."""
        types = {name: (array.dtype, array.shape) for name, array in self.sums._asdict().items()}
        sums = Sums(**{name: saved.array(name, dtype, *shape) for name, (dtype, shape) in types.items()})
        if not 1 <= sums.samples.min() <= sums.samples.max() <= most:
            raise ValueError(f"the film has pixels of {sums.samples.min()} to {sums.samples.max()} samples")
        heaviest = sums.weight.max()
        if not 0 < sums.weight.min() <= heaviest < np.inf:
            raise ValueError("the film has samples that count nothing, or more than all")
        for values, largest in ((sums.sum, BRIGHTEST), (sums.squares, BRIGHTEST**2)):
            if not -largest * heaviest <= values.min() <= values.max() <= largest * heaviest:
                raise ValueError("the film has values that no image can have")
        self.sums = sums

    @property
    def samples(self) -> int:
        """The number of samples of the pixel with the most samples."""
        return int(self.sums.samples.max())

    @property
    def counts(self) -> np.ndarray:
        """The number of samples of each pixel, (height, width)."""
        return self.sums.samples.reshape(self.shape[:2])

    def mean(self) -> np.ndarray:
        """The image, (height, width, 3) float32, linear, top row first."""
        return (self.sums.sum * (self._exposure / self._divisor())).astype(np.float32).reshape(self.shape)

    def variance_of_mean(self) -> np.ndarray:
        """Estimated variance of each value of `mean`, (height, width, 3) float64; needs two samples or more.

        It is sum w (L - mean)^2 / sum w / (n - 1), for n independent samples L with weights w. Stratified samples have a smaller variance,
        so this is an upper bound. The formula assumes that weights are inverse variances.
        """
        weight, others = self._divisor(), np.maximum(self.sums.samples - 1, 1)[:, None]
        spread = self.sums.squares / weight - (self.sums.sum / weight) ** 2
        return (np.maximum(spread, 0) * (self._exposure**2 / others)).reshape(self.shape)

    def noise(self) -> np.ndarray:
        """Standard error of each pixel over the root of its brightness, (height, width). Cycles' noise threshold bounds this number.

        If samples are stratified, it is an upper bound, like `variance_of_mean`.
        """
        return (np.sqrt(self.variance_of_mean().sum(axis=2)) / (1e-4 + np.sqrt(self.mean().sum(axis=2)))).astype(np.float32)

    def layers(self) -> dict[str, np.ndarray]:
        """The passes by Cycles' names, (height, width) or (height, width, 3) float32; empty if the film has no passes."""
        if not len(self.sums.passes):
            return {}
        mean = self.sums.passes / self._divisor().astype(np.float32)
        mean[:, EMISSION:] *= self._exposure
        layers = {name: self._layer(mean[:, first : first + count]) for name, (first, count) in PASSES.items()}
        layers["Indirect"] = self.mean() - layers["Emission"] - layers["Direct"]
        layers["Variance"] = self.variance_of_mean().astype(np.float32)
        layers["Sample Count"] = self.counts.astype(np.float32)
        return layers

    def alpha(self) -> np.ndarray:
        """Share of each pixel that is not the transparent world, (height, width) float32; 1 if the film has no passes."""
        if not len(self.sums.passes):
            return np.ones(self.shape[:2], np.float32)
        return (1 - self.sums.passes[:, ALPHA] / self._divisor()[:, 0]).astype(np.float32).reshape(self.shape[:2])

    def _divisor(self) -> np.ndarray:
        return np.where(self.sums.samples > 0, self.sums.weight, 1.0)[:, None]

    def _layer(self, columns: np.ndarray) -> np.ndarray:
        return columns.reshape(self.shape) if columns.shape[1] == 3 else columns.reshape(self.shape[:2])


@part
def add_sample(film, pixel, L, weight):
    """Add a sample to the sums of its pixel. Returns whether the sample is finite."""
    w = np.float64(weight)
    for c in range(3):
        value = np.float64(L[c])
        film.sum[pixel, c] += w * value
        film.squares[pixel, c] += w * value * value
    film.samples[pixel] += 1
    film.weight[pixel] += w
    return np.isfinite(L[0] + L[1] + L[2])


@part
def credit(passes, pixel, weight, light, scattered):
    """Add light to a pass: to Emission after 0 scattering events, to Direct after 1. Other light is not added."""
    if scattered <= 1:
        column = EMISSION if scattered == 0 else DIRECT
        for c in range(3):
            passes[pixel, column + c] += weight * light[c]


@part
def hide(passes, pixel, weight, share):
    """Add a share of the pixel, RGB, to the transparent world."""
    passes[pixel, ALPHA] += weight * (share[0] + share[1] + share[2]) * F(1 / 3)


@part
def write_features(passes, pixel, weight, axes, origin, x, n, colour):
    """Add to the passes that describe the first surface. axes: the camera's axes. x: the position relative to `origin`."""
    for c in range(3):
        passes[pixel, ALBEDO + c] += weight * colour[c]
        passes[pixel, SHADING_NORMAL + c] += weight * n[c]
        passes[pixel, POSITION + c] += weight * (origin[c] + x[c])
    depth = (axes[3, 0] - x[0]) * axes[2, 0] + (axes[3, 1] - x[1]) * axes[2, 1] + (axes[3, 2] - x[2]) * axes[2, 2]
    passes[pixel, DEPTH] += weight * depth
