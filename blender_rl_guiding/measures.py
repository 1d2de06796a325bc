"""The measures of an image's error, as files, tables and menus call them. `images.metrics` has the function of each name."""

from typing import NamedTuple


class Measure(NamedTuple):
    """One measure; lower is better."""

    name: str  # in files and tables
    label: str  # in menus
    about: str


# A .blend keeps a measure's place in this list: append new ones.
MEASURES = (
    Measure("mape_display", "MAPE (Display)", "Mean relative error of square roots of what a screen can show: the measure of the slides"),
    Measure("mape", "MAPE", "Mean of |I - R| / (R + 0.01)"),
    Measure("relmse", "relMSE", "Mean of (I - R)² / (R² + 0.01): falls as 1 / samples"),
    Measure("flip", "FLIP", "The difference that a person sees when flipping between both images, 0 to 1"),
)
NAMES = tuple(measure.name for measure in MEASURES)
