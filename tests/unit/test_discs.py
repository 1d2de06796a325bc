"""Hemispheres as discs: all patches have equal areas and the right places. Also: means over other patches, and scales."""

import math

import numpy as np
import pytest

from blender_rl_guiding.report import discs
from blender_rl_guiding.report.charts import Axis

SIZE = 240
AXIS = Axis(True, -1.0, 0.0)


def lit(rows: int, columns: int, row: int, column: int) -> np.ndarray:
    """The share of each pixel that one bright patch covers, (SIZE, SIZE), 0..1; all other patches are dark."""
    values = np.zeros((rows, columns))
    values[row, column] = 1.0
    rgba = discs.picture(values, AXIS, SIZE).astype(float)
    assert rgba.shape == (SIZE, SIZE, 4)
    return np.where(rgba[..., 3] > 0, rgba[..., 0] / rgba[..., 0].max(), 0)


def test_patches_have_equal_areas():
    areas = [lit(3, 4, row, column).sum() for row in range(3) for column in range(4)]
    np.testing.assert_allclose(areas, math.pi * (SIZE / 2) ** 2 / 12, rtol=0.02)


@pytest.mark.parametrize(
    ("row", "column", "x", "y"),
    [(0, 0, 1, 0.41), (0, 1, 0.41, 1), (0, 2, -0.41, 1), (0, 4, -1, -0.41), (0, 7, 1, -0.41), (3, 0, 1, 0.41)],
)
def test_a_direction_stands_where_it_points(row, column, x, y):
    """4 x 8 patches: +x is to the right, +y is up, and higher rows are nearer to the centre."""
    place = (np.arange(SIZE) + 0.5) / SIZE * 2 - 1
    seen = lit(4, 8, row, column)
    centre = np.array([(seen * place[None, :]).sum(), (seen * -place[:, None]).sum()]) / seen.sum()
    radius = 0.92 if row == 0 else 0.33  # of the sector's centroid: a little less than the ring's mean radius
    np.testing.assert_allclose(centre, radius * np.array([x, y]) / math.hypot(x, y), atol=0.03)


def test_outside_of_the_disc_there_is_nothing():
    alpha = discs.picture(np.ones((2, 3)), AXIS, SIZE)[..., 3]
    assert alpha[0, 0] == alpha[-1, -1] == 0
    assert alpha[SIZE // 2, 1] == alpha[SIZE // 2, SIZE // 2] == 255


def test_means_over_other_patches():
    fine = np.random.default_rng(1).random((6, 12))
    np.testing.assert_allclose(discs.averaged(fine, 2, 4), fine.reshape(2, 3, 4, 3).mean(axis=(1, 3)))
    np.testing.assert_allclose(discs.averaged(fine, 6, 12), fine)
    assert discs.averaged(fine, 4, 5).mean() == pytest.approx(fine.mean())
    np.testing.assert_allclose(discs.averaged(np.array([[1.0, 2.0, 6.0]]), 1, 2), [[(1 + 0.5 * 2) / 1.5, (0.5 * 2 + 6) / 1.5]])
    np.testing.assert_allclose(discs.averaged(np.array([[1.0, 2.0]]), 1, 4), [[1, 1, 2, 2]])


def test_relative_errors():
    truth = np.array([[1.0, 1.0, 3.0, 3.0]])
    assert discs.relative_error(np.array([[1.0, 3.0]]), truth) == 0
    assert discs.relative_error(np.array([[2.0, 2.0]]), truth) == pytest.approx(0.5)
    assert discs.relative_error(np.zeros((2, 2)), np.zeros((4, 4))) == 0
    assert discs.relative_error(np.ones((2, 2)), np.zeros((4, 4))) == math.inf


def test_a_scale_is_common_and_holds_all_but_the_darkest():
    axis = discs.scale([np.full((2, 2), 0.2), np.array([[20.0, 0.0]])])
    assert axis.ends == pytest.approx((0.2, 20))
    assert discs.scale([np.array([1e-9, 1e-9, 1.0])]).ends == pytest.approx((1e-4, 1))
    assert discs.scale([np.full((2, 2), 3.0)]).ends == pytest.approx((0.3, 3))
    assert discs.scale([np.zeros((2, 2))]).ends == pytest.approx((0.1, 1))
    for decades in (1.0, 2.4, 2.6, 4.0):
        assert 2 <= len(discs.labels(Axis(True, -1.7, decades - 1.7))) <= 5


def test_the_ends_of_a_scale_are_black_and_yellow():
    dark, bright = (discs.picture(np.full((1, 1), value), AXIS, 9)[4, 4].astype(int) for value in (0.0, 7.0))
    assert dark[:3].max() < 10
    assert bright[:2].min() > 240


def test_directions_are_called_by_their_axis():
    assert [discs.direction(v) for v in ((1, 0, 0), (0, -1, 0), (0, 0, 1))] == ["+x", "-y", "+z"]
    assert discs.direction((0.6, 0.0, -0.8)) == "(0.60, 0.00, -0.80)"
