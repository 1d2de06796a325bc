"""The replay memory forgets the oldest first and draws without replacement."""

import numpy as np
import pytest

from blender_rl_guiding.guiding.replay import BYTES, Experience, ReplayMemory, no_experience


def numbered(first: int, count: int) -> Experience:
    """Transitions first .. first + count - 1; every field of a transition has its number as the value."""
    numbers = np.arange(first, first + count)
    return Experience(*(np.broadcast_to(numbers.reshape(-1, *[1] * (a.ndim - 1)), a.shape).astype(a.dtype) for a in no_experience(count)))


def held(memory: ReplayMemory) -> list[int]:
    """The numbers of all transitions in the memory. Asserts that all fields of a transition have the same number."""
    drawn = memory.sample(len(memory), np.random.default_rng(0))
    for array in drawn:
        np.testing.assert_array_equal(array.reshape(len(memory), -1)[:, 0], drawn.reward)
    return sorted(drawn.reward.tolist())


@pytest.mark.parametrize(
    ("added", "expected"),
    [([3], range(3)), ([7], range(7)), ([5, 4], range(2, 9)), ([20], range(13, 20)), ([3, 20, 2], range(18, 25)), ([0, 3], range(3))],
)
def test_the_last_remain(added, expected):
    memory, first = ReplayMemory(7), 0
    for count in added:
        memory.add(numbered(first, count))
        first += count
    assert held(memory) == list(expected)


def test_batches_are_drawn_without_replacement_and_uniformly():
    memory, rng, counts = ReplayMemory(10), np.random.default_rng(1), np.zeros(10)
    memory.add(numbered(0, 10))
    for _ in range(2000):
        drawn = memory.sample(4, rng).reward.astype(int)
        assert len(set(drawn.tolist())) == 4
        counts[drawn] += 1
    np.testing.assert_allclose(counts, 800, atol=5 * np.sqrt(2000 * 0.4 * 0.6))  # five sigma of the binomial


def test_fewer_than_a_batch_are_all():
    memory = ReplayMemory(10)
    memory.add(numbered(0, 3))
    assert sorted(memory.sample(8, np.random.default_rng(0)).reward) == [0, 1, 2]


def test_memory_is_a_copy():
    memory, new = ReplayMemory(4), numbered(0, 2)
    memory.add(new)
    new.reward[:] = 9
    assert held(memory) == [0, 1]


def test_bytes_of_one():
    assert sum(array.nbytes for array in no_experience(1)) == BYTES
