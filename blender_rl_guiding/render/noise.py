"""The number of samples that each pixel still needs to reach the noise limit."""

import numpy as np

from ..settings import Render
from .film import Film

LEAST_SAMPLES = 16  # least samples of a pixel before its noise estimate is used


def needed(film: Film, settings: Render, taken: int) -> np.ndarray:
    """Samples that each pixel still needs after `taken` samples, (height, width) int32; 0 where the pixel is finished.

    Noise falls as 1 / sqrt(n), so a pixel with n samples needs n ((noise / limit)^2 - 1) more, and at least as many as each neighbour.
    """
    rest = settings.spp - taken
    if not settings.noise:
        return np.full(film.shape[:2], rest, np.int32)
    noise = film.noise()
    more = np.ceil(film.counts * ((noise.astype(np.float64) / settings.noise) ** 2 - 1)).clip(1, rest)
    more = np.where(noise > settings.noise, more, 0).astype(np.int32)
    return _of_neighbours(more).clip(min=min(LEAST_SAMPLES - taken, rest))


def _of_neighbours(values: np.ndarray) -> np.ndarray:
    """The largest value of each pixel and its eight neighbours."""
    padded = np.pad(values, 1)
    rows = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    return np.maximum(np.maximum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:])
