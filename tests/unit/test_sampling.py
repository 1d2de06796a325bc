"""Vectors, table look-up and tangent frames equal numbers computed by hand. For warps and streams see tests/statistical."""

import numpy as np
import pytest

from blender_rl_guiding.kernels import kernel, sampling
from blender_rl_guiding.kernels.sampling import F

UP = (F(0), F(0), F(1))
A, B = (F(1), F(-2), F(3)), (F(0.5), F(4), F(-1))


@kernel
def arithmetic(a, b, s):
    return sampling.add(a, b), sampling.subtract(a, b), sampling.multiply(a, b), sampling.scale(a, s), sampling.cross(a, b)


@kernel
def lengths(a, b):
    return sampling.dot(a, b), sampling.normalize(a), sampling.luminance(a)


@kernel
def store_and_accumulate(array, i, a, b):
    sampling.store(array, i, a)
    sampling.accumulate(array, i, b)
    return sampling.vector(array, i)


@kernel
def search(cdf, row, u, found):
    for i in range(len(u)):
        found[i] = sampling.pick(cdf, row, cdf.shape[1], u[i])


@kernel
def frames(normals, tangents, bitangents):
    for i in range(len(normals)):
        t, b = sampling.tangents(sampling.vector(normals, i))
        sampling.store(tangents, i, t)
        sampling.store(bitangents, i, b)


@kernel
def there_and_back(n, v):
    t, b = sampling.tangents(n)
    return sampling.to_local(t, b, n, sampling.to_world(t, b, n, v)), sampling.to_world(t, b, n, (F(0), F(0), F(1)))


def test_vectors():
    assert arithmetic(A, B, F(2)) == ((1.5, 2, 2), (0.5, -6, 4), (0.5, -8, -3), (2, -4, 6), tuple(np.cross(A, B)))
    assert lengths(A, B)[0] == -10.5
    assert lengths((F(0), F(-3), F(4)), B)[1] == pytest.approx((0, -0.6, 0.8))
    assert np.isnan(lengths((F(0), F(0), F(0)), B)[1]).all()


def test_rows_of_arrays():
    array = np.zeros((3, 3), np.float32)
    assert store_and_accumulate(array, 1, A, B) == (1.5, 2, 2)
    np.testing.assert_array_equal(array, [(0, 0, 0), (1.5, 2, 2), (0, 0, 0)])


def test_luminance_of_white_and_of_the_primaries():
    colors = [(1, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    assert [lengths(tuple(map(F, c)), B)[2] for c in colors] == pytest.approx([1, 0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("cdf", [[1.0], [0.25, 1.0], [0.0, 0.5, 0.5, 1.0], [0.1, 0.2, 0.2, 0.2, 0.9, 1.0, 1.0]])
def test_pick_is_numpys_search(cdf):
    table = np.array([[9.0] * len(cdf), cdf], np.float32)
    u = np.array([*np.linspace(0, 1, 41, endpoint=False), *table[1][table[1] < 1], 1 - 2**-24], np.float32)
    found = np.empty(len(u), np.int64)
    search(table, 1, u, found)
    np.testing.assert_array_equal(found, np.searchsorted(table[1], u, side="right"))
    assert np.diff(table[1], prepend=0)[found].min() > 0, "an entry of probability zero"


# --- tangent frames --------------------------------------------------------------------------------------------------


def frame(normals: np.ndarray) -> np.ndarray:
    """(tangent, bitangent, normal) for each of n normals: (n, 3, 3)."""
    normals = np.ascontiguousarray(normals, np.float32)
    tangents, bitangents = np.empty_like(normals), np.empty_like(normals)
    frames(normals, tangents, bitangents)
    return np.stack([tangents, bitangents, normals], axis=1)


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


AXES = [np.roll(sign * np.eye(3)[0], axis) for axis in range(3) for sign in (1.0, -1.0)]


def test_tangents_are_orthonormal_and_right_handed():
    slanted = [(np.sqrt(1 - z * z), 0, z) for z in np.linspace(-1, 1, 401)]  # through the seam at z = -0.8
    axes = frame(np.concatenate([unit(np.random.default_rng(3).normal(size=(2000, 3))), slanted, AXES]))
    np.testing.assert_allclose(axes @ axes.swapaxes(1, 2), np.broadcast_to(np.eye(3), axes.shape), atol=3e-6)
    np.testing.assert_allclose(np.linalg.det(axes), 1, atol=1e-5)


@pytest.mark.parametrize("axis", AXES, ids=str)
def test_tangents_do_not_jump_around_an_axis(axis):
    nudged = unit(axis + np.random.default_rng(4).normal(size=(200, 3)) * 1e-3)
    assert np.abs(frame(nudged) - frame(axis[None])).max() < 0.02


def test_local_and_world_are_inverse():
    n, v = tuple(map(F, (0.48, -0.6, 0.64))), tuple(map(F, (0.3, -1.7, 0.9)))
    again, up = there_and_back(n, v)
    np.testing.assert_allclose(again, v, atol=1e-6)
    np.testing.assert_allclose(up, n, atol=1e-7)


@kernel
def circles(turns, out):
    for i in range(len(turns)):
        out[i, 0], out[i, 1] = sampling.circle(turns[i])


def test_circle_is_cosine_and_sine():
    turns = np.linspace(-1, 1, 100_001, dtype=np.float32)
    found = np.empty((len(turns), 2), np.float32)
    circles(turns, found)
    angles = 2 * np.pi * turns.astype(np.float64)
    np.testing.assert_allclose(found, np.stack([np.cos(angles), np.sin(angles)], axis=1), rtol=0, atol=2e-7)


@kernel
def places(numbers, count, out):
    for i in range(len(numbers)):
        out[i] = sampling.place(numbers[i], count)


def test_whatever_a_number_is_its_place_is_one():
    numbers = np.float32([0, 0.99, 1, 5.5, 6.99, 7, 8, 1e30, np.inf, -0.5, -1, -1e30, -np.inf, np.nan])
    out = np.empty(len(numbers), np.int64)
    places(numbers, 7, out)
    assert out.tolist() == [0, 0, 1, 5, 6, 6, 6, 6, 6, 0, 0, 0, 0, 0]
