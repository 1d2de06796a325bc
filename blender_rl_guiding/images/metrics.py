"""The error of an image: its measures, and maps of two. I: image, R: reference, (H, W, 3) linear RGB."""

import numpy as np
from flip_evaluator import evaluate

from ..errors import InputError
from ..measures import NAMES

LARGEST = 1e30  # largest error or radiance; `result_file` reads no larger values, so that sums stay finite


def mape_display(image: np.ndarray, reference: np.ndarray) -> float:
    """Mean of |i - r| / (r + 0.001) over pixels and channels, where i, r = sqrt(clip(I, 0, 1)), sqrt(clip(R, 0, 1)).

    This is the measure of the published slides. It clips values above white.
    """
    i, r = (np.sqrt(np.clip(x.astype(np.float64), 0.0, 1.0)) for x in (image, reference))
    return float(np.mean(np.abs(i - r) / (r + 0.001)))


def mape(image: np.ndarray, reference: np.ndarray) -> float:
    """Mean of |I - R| / (R + 0.01) over pixels and channels."""
    return _told(mape_map(image, reference))


def mape_map(image: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """|I - R| / (R + 0.01), mean over channels, (H, W) float64; its mean is `mape`."""
    i, r = image.astype(np.float64), reference.astype(np.float64)
    return (np.abs(i - r) / (r + 0.01)).mean(axis=-1)


def relmse(image: np.ndarray, reference: np.ndarray) -> float:
    """Mean of (I - R)^2 / (R^2 + 0.01) over pixels and channels, no pixel left out."""
    i, r = image.astype(np.float64), reference.astype(np.float64)
    return _told((i - r) ** 2 / (r**2 + 0.01))


def _told(errors: np.ndarray) -> float:
    """The mean, clipped to 0..`LARGEST`. Without the clip it could be negative, if a given reference has negative pixels."""
    return float(errors.mean().clip(0.0, LARGEST))


def flip(image: np.ndarray, reference: np.ndarray) -> float:
    """Mean HDR-FLIP: the difference that a person sees when flipping between both images, 0..1 (Andersson et al. 2021)."""
    return float(flip_map(image, reference).mean())


def flip_map(image: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """HDR-FLIP per pixel, (H, W) float32 in 0..1, at 67 pixels per degree; exposures are chosen from the reference.

    Values below 0 count as 0. A black reference has no exposure of its own: it is compared at exposure 0.
    """
    r, i = (np.ascontiguousarray(np.maximum(x, 0.0), np.float32) for x in (reference, image))
    # Below single precision's epsilon, flip-evaluator finds no range of exposures and ends the process.
    black = r.max() <= np.finfo(np.float32).eps
    exposures = {"startExposure": 0.0, "stopExposure": 0.0, "numExposures": 2} if black else {}
    return evaluate(r, i, "HDR", applyMagma=False, computeMeanError=False, parameters=exposures)[0][..., 0]


def compare(image: np.ndarray, reference: np.ndarray) -> dict[str, float]:
    """All measures by their names. InputError if the shapes differ or a pixel is not a finite number."""
    if image.shape != reference.shape:
        raise InputError(f"the image is {_size(image)}, but the reference is {_size(reference)}")
    for name, pixels in (("image", image), ("reference", reference)):
        bad = np.argwhere(~np.isfinite(pixels).all(axis=-1))
        if len(bad):
            y, x = bad[0]
            raise InputError(f"the {name} has {len(bad)} pixels that are not finite numbers; the first is row {y}, column {x}")
    functions = (mape_display, mape, relmse, flip)
    return {name: function(image, reference) for name, function in zip(NAMES, functions, strict=True)}


def _size(image: np.ndarray) -> str:
    return f"{image.shape[1]} x {image.shape[0]} pixels"
