"""The keyed random streams: uniform along each part of the key, independent of their neighbours, stratified over samples."""

import itertools
from typing import Any

import numpy as np
import pytest

from blender_rl_guiding.kernels import kernel, sampling
from blender_rl_guiding.kernels.sampling import BLOCK
from tests.significance import assert_distributed, assert_uniform

N = 400_000


@kernel
def draw_streams(seeds, pixels, samples, dimensions, stratified, out):
    for i in range(len(seeds)):
        u, v = sampling.uniform2(sampling.stream(seeds[i], pixels[i], samples[i], stratified), dimensions[i])
        out[i, 0] = u
        out[i, 1] = v


@kernel
def key_streams(of, stratified, keys):
    for i in range(len(of)):
        key = sampling.stream(of[i, 0], of[i, 1], of[i, 2], stratified)
        keys[i, 0] = key.bits
        keys[i, 1] = np.uint64(key.place)


def draws(stratified: bool, seed: Any = 0, pixel: Any = 0, sample: Any = 0, dimension: Any = 0) -> np.ndarray:
    """Pairs of numbers (..., 2) for keys; the parts of keys are broadcast."""
    keys = np.broadcast_arrays(seed, pixel, sample, dimension)
    out = np.empty((keys[0].size, 2), np.float32)
    draw_streams(*(np.ascontiguousarray(key, np.int64).ravel() for key in keys), stratified, out)
    return out.reshape(*keys[0].shape, 2)


I = np.arange(N)  # noqa: E741  # the index of a draw
both = pytest.mark.parametrize("stratified", [True, False], ids=["stratified", "independent"])


@both
@pytest.mark.parametrize("along", ["seed", "pixel", "sample", "dimension"])
def test_streams_are_uniform_along_every_part_of_the_key(along, stratified):
    if along == "sample" and stratified:  # stratified samples of a pixel are far more uniform than random ones
        drawn = draws(True, pixel=I // 8, sample=I * 7919 % 1_000_000)
    else:
        drawn = draws(stratified, **{along: I}) if along != "dimension" else draws(stratified, pixel=I // 64, dimension=I % 64)
    assert drawn.max() < 1
    np.testing.assert_array_equal(drawn * 2**24 % 1, 0)
    assert_uniform(drawn, 32)
    for column in drawn.T:
        assert_uniform(column[:, None], 1024)
        assert_uniform((column[:, None] * 2**12) % 1, 1024)  # low bits are uniform, too


NEIGHBOURS = {
    "dimensions": ({"pixel": I, "dimension": 3}, {"pixel": I, "dimension": 4}),
    "vertices": ({"pixel": I, "dimension": 3}, {"pixel": I, "dimension": 11}),
    "pixels": ({"pixel": 2 * I}, {"pixel": 2 * I + 1}),
    "pixels, later": ({"pixel": 2 * I, "sample": 77_777}, {"pixel": 2 * I + 1, "sample": 77_777}),
    "seeds": ({"seed": 0, "pixel": I}, {"seed": 1, "pixel": I}),
    "seeds and pixels": ({"seed": 1, "pixel": I}, {"seed": 0, "pixel": I + 1}),
    "samples of dimensions": ({"pixel": I, "sample": 6, "dimension": 3}, {"pixel": I, "sample": 7, "dimension": 4}),
    "samples of pixels": ({"pixel": 2 * I, "sample": 6}, {"pixel": 2 * I + 1, "sample": 7}),
}


@both
@pytest.mark.parametrize("of", NEIGHBOURS)
def test_neighbouring_streams_are_independent(of, stratified):
    one, other = (draws(stratified, **key) for key in NEIGHBOURS[of])
    for a, b in itertools.product(one.T, other.T):
        assert_uniform(np.stack([a, b], axis=1), 24)


def test_independent_samples_are_independent():
    one, other = draws(False, pixel=I, sample=6), draws(False, pixel=I, sample=7)
    for a, b in itertools.product(one.T, other.T):
        assert_uniform(np.stack([a, b], axis=1), 24)


@both
def test_streams_are_pure_functions_of_their_keys_and_all_different(stratified):
    of = np.array(list(itertools.product((0, 1, 2**31 - 1), range(30), (0, 1, 999_999, 1_048_576, 2**31))), np.int64)
    keys = np.empty((len(of), 2), np.uint64)
    key_streams(of, stratified, keys)
    assert len(np.unique(keys, axis=0)) == len(of)
    np.testing.assert_array_equal(draws(stratified, pixel=I), draws(stratified, pixel=I[::-1])[::-1])


# --- stratified --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("block", [0, 3, 950])
@pytest.mark.parametrize("k", [1, 2, 5, 10])
def test_every_elementary_interval_holds_one_of_each_block_of_samples(k, block):
    """A (0, 2)-sequence in every pixel: of 2^k samples, beginning at a multiple of 2^k, each cell 2^-a x 2^-(k - a) has one, for all a."""
    pixels, samples = np.arange(60)[:, None], block * 2**k + np.arange(2**k)
    drawn = draws(True, seed=pixels % 3, pixel=pixels, sample=samples, dimension=pixels % 11).astype(float)
    for a in range(k + 1):
        cell = (drawn[..., 0] * 2**a).astype(int) * 2 ** (k - a) + (drawn[..., 1] * 2 ** (k - a)).astype(int)
        np.testing.assert_array_equal(np.sort(cell, axis=1), np.broadcast_to(np.arange(2**k), cell.shape))


def test_blocks_of_samples_are_independent():
    """Indices of blocks keep all their bits: the last samples have their own random numbers."""
    one, other = draws(True, pixel=I, sample=6), draws(True, pixel=I, sample=6 + BLOCK)
    for a, b in itertools.product(one.T, other.T):
        assert_uniform(np.stack([a, b], axis=1), 24)
    last = draws(True, sample=999_999 - np.arange(BLOCK * 64))
    assert len(np.unique(last, axis=0)) > 0.999 * len(last)
    assert_uniform(last, 32)


@pytest.mark.parametrize("k", [3, 6])
def test_dimensions_of_a_pixel_do_not_correlate(k):
    """Over 2^k samples, the correlation of two dimensions has mean 0, and the variance of random nested orders.

    In such an order, the higher bits decide at random whether bit b < k of x is flipped. The variance of sum x y / sum x^2 is then
    2 sum_b 8^-b / (sum_b 4^-b)^2 / 2^k.
    """
    pixels, samples, count, bits = np.arange(20_000)[:, None], np.arange(2**k), 2**k, np.arange(k)
    nested = 2 * (8.0**-bits).sum() / (4.0**-bits).sum() ** 2 / count
    drawn = [draws(True, pixel=pixels, sample=samples, dimension=d).astype(float) for d in (3, 4, 5, 11)]
    strata = [np.floor(pair * count) - (count - 1) / 2 for pair in drawn]  # each stratum occurs once
    for one, other in itertools.combinations(strata, 2):
        for i, j in itertools.product(range(2), repeat=2):
            r = (one[..., i] * other[..., j]).sum(axis=1) / (one[..., i] ** 2).sum(axis=1)
            assert abs(r.mean()) < 5 * np.sqrt(nested / len(r))
            assert r.var() == pytest.approx(nested, rel=0.15)


@pytest.mark.parametrize("k", [1, 2, 3])
def test_the_order_of_samples_in_a_pixel_is_a_chance_order(k):
    """For a sample, all 2^k x 2^k pairs (stratum of one number, stratum of another number) are equally likely."""
    pixels, count = I[:, None], 2**k
    one, other = (np.floor(draws(True, pixel=pixels, sample=np.arange(count), dimension=d) * count) for d in (3, 4))
    for i, j, sample in itertools.product(range(2), range(2), range(count)):
        pairs = (one[:, sample, i] * count + other[:, sample, j]).astype(int)
        assert_distributed(np.bincount(pairs, minlength=count * count), np.full(count * count, N / count**2))


@pytest.mark.parametrize("name", ["smooth", "step", "corner"])
def test_means_are_unbiased_and_far_less_noisy(name):
    """Errors of integrals over the square with 16 samples: a smooth function, a half plane, a rectangle."""
    integrand, truth, limit = {
        "smooth": (lambda u, v: u * v, 0.25, 0.03),
        "step": (lambda u, v: u + v < 0.8, 0.32, 0.4),
        "corner": (lambda u, v: (u < 0.3) & (v < 0.7), 0.21, 0.3),
    }[name]
    means, spread = {}, {}
    for stratified in (True, False):
        drawn = draws(stratified, pixel=np.arange(20_000)[:, None], sample=np.arange(16), dimension=4).astype(float)
        values = integrand(drawn[..., 0], drawn[..., 1]).mean(axis=1)
        means[stratified], spread[stratified] = values.mean(), values.var()
        assert values.mean() == pytest.approx(truth, abs=4.5 * values.std() / np.sqrt(len(values)))
    assert spread[True] < limit * spread[False]
