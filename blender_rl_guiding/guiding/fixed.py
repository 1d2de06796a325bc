"""The guides that never learn: `uniform`, the slides' baseline, and `bsdf`, the honest one."""

from typing import Any

from .base import OnStep, Transitions, unheard
from .directions import Directions, one_cell
from .saved import Arrays, Saved


class FixedGuide:
    """The same directions from the first pass to the last."""

    def __init__(self, directions: Directions) -> None:
        self._directions = directions

    def directions(self) -> Directions:
        return self._directions

    def wanted(self) -> int:
        return 0

    def learn(self, transitions: Transitions, on_step: OnStep = unheard) -> dict[str, Any]:
        return {}

    def state(self) -> Arrays:
        return {}

    def restore(self, saved: Saved) -> None: ...


def uniform() -> FixedGuide:
    """pdf 1 / (2 pi) over the hemisphere."""
    return FixedGuide(one_cell(bsdf_fraction=0.0))


def bsdf() -> FixedGuide:
    """The material's own sampling."""
    return FixedGuide(one_cell(bsdf_fraction=1.0))
