"""The measures of an image's error, with their names in files, tables and menus. `images.metrics` has a function for each name."""

from typing import NamedTuple


class Measure(NamedTuple):
    """One measure; lower is better."""

    name: str  # in files and tables
    label: str  # in menus
    about: str


# A .blend stores a measure's index in this list, so append new measures at the end.
MEASURES = (
    Measure(
        "mape_display",
        "MAPE (Display)",
        "Mean of |i - r| / (r + 0.001) with i = sqrt(clip(I, 0, 1)), r = sqrt(clip(R, 0, 1)): the measure of the slides",
    ),
    Measure("mape", "MAPE", "Mean of |I - R| / (R + 0.01)"),
    Measure("relmse", "relMSE", "Mean of (I - R)² / (R² + 0.01): falls as 1 / samples"),
    Measure("flip", "FLIP", "The difference that a person sees when flipping between both images, 0 to 1"),
)
NAMES = tuple(measure.name for measure in MEASURES)
