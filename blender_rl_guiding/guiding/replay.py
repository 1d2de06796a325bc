"""Replay memory: the last transitions, in a ring, from which training draws batches."""

import numpy as np

from .base import Transitions


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
            self._ring = Transitions(*(np.zeros((self.capacity, *array.shape[1:]), array.dtype) for array in new))
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
