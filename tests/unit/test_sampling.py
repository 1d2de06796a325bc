"""Vectors, table look-up and tangent frames by hand-computed numbers; warps and streams are in tests/statistical."""

import numpy as np
import pytest

from blender_rl_guiding import sampling
from blender_rl_guiding.sampling import F

UP = (F(0), F(0), F(1))
A, B = (F(1), F(-2), F(3)), (F(0.5), F(4), F(-1))


def test_vectors():
    assert sampling.dot(A, B) == -10.5
    assert sampling.add(A, B) == (1.5, 2, 2)
    assert sampling.subtract(A, B) == (0.5, -6, 4)
    assert sampling.multiply(A, B) == (0.5, -8, -3)
    assert sampling.scale(A, F(2)) == (2, -4, 6)
    assert sampling.normalize((F(0), F(-3), F(4))) == pytest.approx((0, -0.6, 0.8))
    assert np.isnan(sampling.normalize((F(0), F(0), F(0)))).all()


def test_rows_of_arrays():
    array = np.zeros((3, 3), np.float32)
    sampling.store(array, 1, A)
    sampling.accumulate(array, 1, B)
    assert sampling.vector(array, 1) == (1.5, 2, 2)
    assert not array[[0, 2]].any()


def test_luminance_of_white_and_of_the_primaries():
    one, none = F(1), F(0)
    assert sampling.luminance((one, one, one)) == pytest.approx(1)
    primaries = [(one, none, none), (none, one, none), (none, none, one)]
    assert [sampling.luminance(c) for c in primaries] == pytest.approx([0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("cdf", [[1.0], [0.25, 1.0], [0.0, 0.5, 0.5, 1.0], [0.1, 0.2, 0.2, 0.2, 0.9, 1.0, 1.0]])
def test_pick_is_numpys_search(cdf):
    table = np.array([[9.0] * len(cdf), cdf], np.float32)
    for u in [*np.linspace(0, 1, 41, endpoint=False), *table[1][table[1] < 1], 1 - 2**-24]:
        found = sampling.pick(table, 1, len(cdf), F(u))
        assert found == np.searchsorted(table[1], F(u), side="right")
        assert table[1, found] > (table[1, found - 1] if found else 0), "an entry of probability zero"


# --- tangent frames --------------------------------------------------------------------------------------------------


def frame(n: np.ndarray) -> np.ndarray:
    return np.array([*sampling.tangents(tuple(np.float32(n))), n])


AXES = [np.roll(sign * np.eye(3)[0], axis) for axis in range(3) for sign in (1.0, -1.0)]


def test_tangents_are_orthonormal_and_right_handed():
    normals = np.random.default_rng(3).normal(size=(2000, 3))
    slanted = [(np.sqrt(1 - z * z), 0, z) for z in np.linspace(-1, 1, 401)]  # through the seam at z = -0.8
    for n in [*(normals / np.linalg.norm(normals, axis=1, keepdims=True)), *np.array(slanted), *AXES]:
        axes = frame(n)
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=3e-6)
        assert np.linalg.det(axes) == pytest.approx(1, abs=1e-5)


@pytest.mark.parametrize("axis", AXES, ids=str)
def test_tangents_do_not_jump_around_an_axis(axis):
    for nudge in np.random.default_rng(4).normal(size=(200, 3)) * 1e-3:
        n = axis + nudge
        assert np.abs(frame(n / np.linalg.norm(n)) - frame(axis)).max() < 0.02


def test_local_and_world_are_inverse():
    n = (sampling.F(0.48), sampling.F(-0.6), sampling.F(0.64))
    t, b = sampling.tangents(n)
    v = (sampling.F(0.3), sampling.F(-1.7), sampling.F(0.9))
    np.testing.assert_allclose(sampling.to_local(t, b, n, sampling.to_world(t, b, n, v)), v, atol=1e-6)
    np.testing.assert_allclose(sampling.to_world(t, b, n, UP), n, atol=1e-7)
