"""Guide `uniform`, the slides' baseline: pdf 1 / (2 pi) over the hemisphere."""

from .base import Guide
from .directions import Directions, one_cell


class UniformGuide(Guide):
    """Draws every direction with the same density."""

    def directions(self) -> Directions:
        return one_cell(bsdf_fraction=0.0)


GUIDE = UniformGuide
