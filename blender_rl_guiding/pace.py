"""How far a render has come, for the renderer and for Blender. Standard library only."""

from typing import NamedTuple


class Pace(NamedTuple):
    """Times of a render under way."""

    seconds: float  # that it has taken
    left: float  # seconds that it will still take

    @property
    def share(self) -> float:
        """The part of its time that is over, 0..1."""
        return self.seconds / max(self.seconds + self.left, 1e-9)
