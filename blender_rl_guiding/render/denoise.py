"""Denoising by Open Image Denoise."""

import numpy as np
import pyoidn

from .film import Film


def denoised(film: Film) -> np.ndarray:
    """The image without noise, (H, W, 3) float32; needs a film with passes."""
    layers = film.layers()
    return pyoidn.denoise(film.mean(), albedo=layers["Albedo"].clip(0, 1), normal=layers["Normal"], hdr=True)
