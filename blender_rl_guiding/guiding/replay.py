"""Replay memory: the last transitions, in a ring, from which training draws batches."""

import numpy as np

from .base import Transitions, empty_transitions
from .saved import Arrays, Saved


class ReplayMemory:
    """Holds up to `capacity` transitions; the oldest make room for new ones."""

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self._ring: Transitions | None = None
        self._next = 0
        self._size = 0

    def __len__(self) -> int:
        return self._size

    def add(self, new: Transitions) -> None:
        """Append transitions in their order; of more than the capacity the last remain."""
        new = Transitions(*(array[-self.capacity :] for array in new))
        if self._ring is None:
            self._ring = empty_transitions(self.capacity)
        places = (self._next + np.arange(len(new.reward))) % self.capacity
        for stored, array in zip(self._ring, new, strict=True):
            stored[places] = array
        self._next = (self._next + len(places)) % self.capacity
        self._size = min(self._size + len(places), self.capacity)

    def sample(self, count: int, rng: np.random.Generator) -> Transitions:
        """Draw `count` transitions uniformly without replacement; all of them if there are no more."""
        assert self._ring is not None, "nothing to sample from"
        chosen = rng.choice(self._size, min(count, self._size), replace=False, shuffle=False)
        return Transitions(*(array[chosen] for array in self._ring))

    def state(self) -> Arrays:
        """All that is remembered, and where in the ring the next transition goes."""
        ring = self._ring or empty_transitions(0)
        return {name: array[: self._size] for name, array in ring._asdict().items()} | {"next": np.array(self._next)}

    def restore(self, saved: Saved) -> None:
        """Take up `state`."""
        stored = empty_transitions(self.capacity)
        size = len(saved.array("reward", np.float32, None))
        if size > self.capacity:
            raise ValueError(f"{size} transitions are remembered, but there is room for {self.capacity}")
        for name, room in stored._asdict().items():
            room[:size] = saved.array(name, np.float32, size, *room.shape[1:])
        for name in ("normal", "direction"):  # they choose patches, and beyond reason none that exists
            array = getattr(stored, name)
            if not (array.min() >= -2 and array.max() <= 2):
                raise ValueError(f"a {name} is not of unit length")
        self._next = saved.whole("next", 0, self.capacity - 1)
        if size < self.capacity and self._next != size:
            raise ValueError(f"the next transition goes to {self._next}, not after the last of {size}")
        self._ring, self._size = stored, size
