"""The progress of a render, for the renderer and for Blender. Standard library only."""

from typing import NamedTuple


class Pace(NamedTuple):
    """Times of a running render."""

    seconds: float  # seconds so far
    left: float  # estimated remaining seconds

    @property
    def share(self) -> float:
        """The part of its time that is over, 0..1."""
        return self.seconds / max(self.seconds + self.left, 1e-9)
