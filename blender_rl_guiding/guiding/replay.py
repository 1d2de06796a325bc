"""Replay memory: the last transitions, in a ring buffer. Training draws batches from it."""

from typing import NamedTuple

import numpy as np

from .saved import Arrays, Saved

BYTES = 60  # of one transition


class Experience(NamedTuple):
    """Transitions for training, as a structure of arrays: x and y in [-1, 1]^3, the action a as the number of a patch."""

    x: np.ndarray  # (n, 3) float32
    n: np.ndarray  # (n, 3) float32, unit normal at x
    patch: np.ndarray  # (n,) int32
    y: np.ndarray  # (n, 3) float32; any value where the path ends
    m: np.ndarray  # (n, 3) float32, unit normal at y
    reward: np.ndarray  # (n,) float32
    albedo: np.ndarray  # (n,) float32


def no_experience(count: int) -> Experience:
    """Room for `count` transitions."""
    x, n, y, m = (np.zeros((count, 3), np.float32) for _ in range(4))
    return Experience(x, n, np.zeros(count, np.int32), y, m, np.zeros(count, np.float32), np.zeros(count, np.float32))


class ReplayMemory:
    """Holds up to `capacity` transitions; the oldest make room for new ones."""

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self._ring: Experience | None = None
        self._next = 0
        self._size = 0

    def __len__(self) -> int:
        return self._size

    def add(self, new: Experience) -> None:
        """Append transitions in their order. Only the last `capacity` of them stay."""
        new = Experience(*(array[-self.capacity :] for array in new))
        if self._ring is None:
            self._ring = no_experience(self.capacity)
        places = (self._next + np.arange(len(new.reward))) % self.capacity
        for stored, array in zip(self._ring, new, strict=True):
            stored[places] = array
        self._next = (self._next + len(places)) % self.capacity
        self._size = min(self._size + len(places), self.capacity)

    def sample(self, count: int, rng: np.random.Generator) -> Experience:
        """Draw `count` transitions uniformly without replacement; all of them if there are no more."""
        assert self._ring is not None, "nothing to sample from"
        chosen = rng.choice(self._size, min(count, self._size), replace=False, shuffle=False)
        return Experience(*(array[chosen] for array in self._ring))

    def state(self) -> Arrays:
        """All that is remembered, and where in the ring the next transition goes."""
        ring = self._ring or no_experience(0)
        return {name: array[: self._size] for name, array in ring._asdict().items()} | {"next": np.array(self._next)}

    def restore(self, saved: Saved, patches: int) -> None:
        """Take a saved `state`. patches: the number of patches. ValueError if the memory cannot be in this state."""
        stored = no_experience(self.capacity)
        size = len(saved.array("reward", np.float32, None))
        if size > self.capacity:
            raise ValueError(f"{size} transitions are remembered, but there is room for {self.capacity}")
        for name, room in stored._asdict().items():
            room[:size] = saved.array(name, room.dtype, size, *room.shape[1:])
        if not (stored.patch.min() >= 0 and stored.patch.max() < patches):
            raise ValueError(f"a patch is not one of {patches}")
        self._next = saved.whole("next", 0, self.capacity - 1)
        if size < self.capacity and self._next != size:
            raise ValueError(f"the next transition goes to {self._next}, not after the last of {size}")
        self._ring, self._size = stored, size
