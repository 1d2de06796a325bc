"""The film: sums over the samples of each pixel."""

import numpy as np

from ..kernels import kernel
from ..sampling import F
from .path_tracer import ALBEDO, ALPHA, DEPTH, DIRECT, EMISSION, PASS_COLUMNS, POSITION, SHADING_NORMAL

# The passes beside the image: name -> (first column, number of columns).
PASSES = {
    "Albedo": (ALBEDO, 3),
    "Normal": (SHADING_NORMAL, 3),
    "Depth": (DEPTH, 1),
    "Position": (POSITION, 3),
    "Emission": (EMISSION, 3),
    "Direct": (DIRECT, 3),
}


class Film:
    """Sum and sum of squares of each pixel's samples, in double precision, how many there are, and sums of the passes if wanted.

    72 bytes a pixel; 140 with passes.
    """

    def __init__(self, width: int, height: int, exposure: float = 1.0, passes: bool = False) -> None:
        self.shape = (height, width, 3)
        self._exposure = exposure
        self._count = np.zeros(width * height, np.int64)
        self._sum = np.zeros((width * height, 3))
        self._squares = np.zeros((width * height, 3))
        self._passes = np.zeros((width * height if passes else 0, PASS_COLUMNS), np.float32)

    def add(self, pixels: np.ndarray, radiance: np.ndarray, passes: np.ndarray) -> None:
        """Add whole samples of some pixels, (samples * pixels, ...), sample by sample.

        FloatingPointError if one of them is not finite: that is a fault of the tracer, and no image may hide it.
        """
        bad = add_samples(pixels, radiance, passes, F(self._exposure), self._sum, self._squares, self._passes, self._count)
        if bad >= 0:
            y, x = divmod(int(pixels[bad % len(pixels)]), self.shape[1])
            raise FloatingPointError(f"pixel ({x}, {y}) received radiance {radiance[bad]}")

    @property
    def samples(self) -> int:
        """Samples of the pixel that has most of them."""
        return int(self._count.max())

    @property
    def counts(self) -> np.ndarray:
        """Samples of each pixel, (height, width)."""
        return self._count.reshape(self.shape[:2])

    def mean(self) -> np.ndarray:
        """The image, (height, width, 3) float32, linear, top row first."""
        return (self._sum / self._divisor()).astype(np.float32).reshape(self.shape)

    def variance_of_mean(self) -> np.ndarray:
        """Estimated variance of each value of `mean`, (height, width, 3) float64; needs two samples or more."""
        n = self._divisor()
        spread = self._squares / n - (self._sum / n) ** 2
        return (np.maximum(spread, 0) / np.maximum(n - 1, 1)).reshape(self.shape)

    def noise(self) -> np.ndarray:
        """Standard error of each pixel relative to the root of its brightness, (height, width): what Cycles' noise threshold bounds."""
        return (np.sqrt(self.variance_of_mean().sum(axis=2)) / (1e-4 + np.sqrt(self.mean().sum(axis=2)))).astype(np.float32)

    def layers(self) -> dict[str, np.ndarray]:
        """The passes by Cycles' names, (height, width) or (height, width, 3) float32; empty unless they were asked for."""
        if not len(self._passes):
            return {}
        mean = self._passes / self._divisor().astype(np.float32)
        layers = {name: self._layer(mean[:, first : first + count]) for name, (first, count) in PASSES.items()}
        layers["Indirect"] = self.mean() - layers["Emission"] - layers["Direct"]
        layers["Variance"] = self.variance_of_mean().astype(np.float32)
        layers["Sample Count"] = self.counts.astype(np.float32)
        return layers

    def alpha(self) -> np.ndarray:
        """Share of each pixel that is not the transparent world, (height, width) float32; needs passes."""
        return (1 - self._passes[:, ALPHA] / self._divisor()[:, 0]).astype(np.float32).reshape(self.shape[:2])

    def _divisor(self) -> np.ndarray:
        return np.maximum(self._count, 1)[:, None]

    def _layer(self, columns: np.ndarray) -> np.ndarray:
        return columns.reshape(self.shape) if columns.shape[1] == 3 else columns.reshape(self.shape[:2])


@kernel
def add_samples(pixels, radiance, passes, exposure, total, squares, pass_total, count):
    """Add each sample to its pixel's sums in their order; the first index that is not finite, or -1."""
    bad = -1
    for i in range(radiance.shape[0]):
        pixel = pixels[i % pixels.shape[0]]
        for c in range(3):
            value = np.float64(radiance[i, c]) * exposure
            if not np.isfinite(value) and bad < 0:
                bad = i
            total[pixel, c] += value
            squares[pixel, c] += value * value
        for c in range(passes.shape[1] if passes.shape[0] > 0 else 0):
            light = c >= EMISSION
            pass_total[pixel, c] += passes[i, c] * exposure if light else passes[i, c]
        count[pixel] += 1
    return bad
