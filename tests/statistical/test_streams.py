"""The keyed random streams: uniform along every part of their key, and independent of their neighbours."""

import itertools
from typing import Any

import numpy as np
import pytest

from blender_rl_guiding import sampling
from blender_rl_guiding.kernels import kernel
from tests.significance import assert_uniform

N = 400_000


@kernel
def draw_streams(seeds, pixels, samples, dimensions, out):
    for i in range(len(seeds)):
        u, v = sampling.uniform2(sampling.stream(seeds[i], pixels[i], samples[i]), dimensions[i])
        out[i, 0] = u
        out[i, 1] = v


@kernel
def key_streams(of, keys):
    for i in range(len(of)):
        keys[i] = sampling.stream(of[i, 0], of[i, 1], of[i, 2])


def draws(seed: Any = 0, pixel: Any = 0, sample: Any = 0, dimension: Any = 0) -> np.ndarray:
    """Pairs of numbers for keys that broadcast against each other."""
    keys = [np.ascontiguousarray(k, np.int64) for k in np.broadcast_arrays(seed, pixel, sample, dimension)]
    out = np.empty((len(keys[0]), 2), np.float32)
    draw_streams(*keys, out)
    return out


I = np.arange(N)  # noqa: E741  # the index of a draw


@pytest.mark.parametrize("along", ["seed", "pixel", "sample", "dimension"])
def test_streams_are_uniform_along_every_part_of_the_key(along):
    drawn = draws(**{along: I}) if along != "dimension" else draws(pixel=I // 64, dimension=I % 64)
    assert drawn.max() < 1
    np.testing.assert_array_equal(drawn * 2**24 % 1, 0)
    assert_uniform(drawn, 32)
    for column in drawn.T:
        assert_uniform(column[:, None], 1024)
        assert_uniform((column[:, None] * 2**12) % 1, 1024)  # the low bits, too


NEIGHBOURS = {
    "dimensions": (draws(pixel=I, dimension=3), draws(pixel=I, dimension=4)),
    "vertices": (draws(pixel=I, dimension=3), draws(pixel=I, dimension=11)),
    "samples": (draws(pixel=I, sample=6), draws(pixel=I, sample=7)),
    "pixels": (draws(pixel=2 * I), draws(pixel=2 * I + 1)),
    "seeds": (draws(seed=0, pixel=I), draws(seed=1, pixel=I)),
    "seeds and pixels": (draws(seed=1, pixel=I), draws(seed=0, pixel=I + 1)),
}


@pytest.mark.parametrize("of", NEIGHBOURS)
def test_neighbouring_streams_are_independent(of):
    one, other = NEIGHBOURS[of]
    for a, b in itertools.product(one.T, other.T):
        assert_uniform(np.stack([a, b], axis=1), 24)


def test_streams_are_pure_functions_of_their_keys_and_all_different():
    of = np.array(list(itertools.product((0, 1, 2**31 - 1), range(30), (0, 1, 999_999))), np.int64)
    keys = np.empty(len(of), np.uint64)
    key_streams(of, keys)
    assert len(np.unique(keys)) == len(keys)
    np.testing.assert_array_equal(draws(pixel=I), draws(pixel=I[::-1])[::-1])
