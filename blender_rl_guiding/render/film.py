"""The film: sums over the samples of each pixel."""

import numpy as np

from ..kernels import kernel


class Film:
    """Sum and sum of squares of each pixel's samples, in double precision, and how many samples there are."""

    def __init__(self, width: int, height: int) -> None:
        self.shape = (height, width, 3)
        self._samples = np.zeros(1, np.int64)  # counted by the kernel, so that no interrupt comes between sums and count
        self._sum = np.zeros((width * height, 3))
        self._squares = np.zeros((width * height, 3))

    def add(self, radiance: np.ndarray) -> None:
        """Add whole samples of the image, (samples * pixels, 3) float32, sample by sample.

        FloatingPointError if one of them is not finite: that is a fault of the tracer, and no image may hide it.
        """
        bad = add_samples(radiance, self._sum, self._squares, self._samples)
        if bad >= 0:
            height, width, _ = self.shape
            x, y = bad % width, bad // width % height
            raise FloatingPointError(f"pixel ({x}, {y}) received radiance {radiance[bad]}")

    @property
    def samples(self) -> int:
        """Whole samples of the image so far."""
        return int(self._samples[0])

    def mean(self) -> np.ndarray:
        """The image, (height, width, 3) float32, linear, top row first."""
        return (self._sum / self.samples).astype(np.float32).reshape(self.shape)

    def variance_of_mean(self) -> np.ndarray:
        """Estimated variance of each value of `mean`, (height, width, 3) float64; needs two samples or more."""
        spread = self._squares / self.samples - (self._sum / self.samples) ** 2
        return (np.maximum(spread, 0) / (self.samples - 1)).reshape(self.shape)


@kernel
def add_samples(radiance, total, squares, samples):
    """Add each sample to its pixel's sums in their order, and their number; the first index that is not finite, or -1."""
    bad = -1
    pixels = total.shape[0]
    for i in range(radiance.shape[0]):
        for c in range(3):
            value = np.float64(radiance[i, c])
            if not np.isfinite(value) and bad < 0:
                bad = i
            total[i % pixels, c] += value
            squares[i % pixels, c] += value * value
    samples[0] += radiance.shape[0] // pixels
    return bad
