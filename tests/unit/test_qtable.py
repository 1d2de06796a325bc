"""The table's learning: the update equals values by hand, cells borrow correctly, and Q converges to its fixed point."""

import numpy as np
import pytest

from blender_rl_guiding.guiding.base import Transitions
from blender_rl_guiding.guiding.directions import UNKNOWN
from blender_rl_guiding.guiding.qtable import LEAST, QTableGuide, added, borrowed, expected_sarsa
from blender_rl_guiding.settings import QTable
from tests import scenes

UP = (0.0, 0.0, 1.0)
ROWS, COLUMNS = 2, 3
N = ROWS * COLUMNS
COSINES = np.repeat([0.25, 0.75], COLUMNS).astype(np.float32)


def new_guide(**settings) -> QTableGuide:
    return QTableGuide(QTable(**({"rows": ROWS, "columns": COLUMNS, "cells": 4} | settings)), scenes.furnace_box(0.5, 1.0), seed=0)


def transitions(positions, rewards, albedos, next_positions) -> Transitions:
    """Transitions between floors (normals +z), in directions all over the hemisphere."""
    n = len(rewards)
    directions = np.random.default_rng(2).normal(size=(n, 3))
    directions[:, 2] = np.abs(directions[:, 2])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    normals = np.broadcast_to(UP, (n, 3))
    values = (positions, normals, directions, next_positions, normals, rewards, albedos)
    return Transitions(*(np.array(v, np.float32) for v in values))


def test_update_by_hand():
    """Patch 4 of cell 0 learns first from cell 1, last from an unknown state. In between, patch 0 of cell 1 learns from cell 0."""
    visits, q, squares = (np.zeros((2, N), np.float32) for _ in range(3))
    arriving = np.array([0, 5], np.float32)
    columns = [(0, 4, 1.0, 0.6, 1), (1, 0, 0.0, 0.5, 0), (0, 4, 3.0, 0.6, UNKNOWN)]
    rows, patches, reward, albedo, nexts = (np.array(column) for column in zip(*columns, strict=True))
    known = visits, q, squares, arriving
    error = expected_sarsa(
        rows.astype(np.int32), patches, reward.astype(np.float32), albedo.astype(np.float32), nexts.astype(np.int32), COSINES, *known
    )
    first = 1 + 0.6 * 2 / N * 5
    second = 0.5 * 2 / N * (first * 0.75)
    assert q[0, 4] == pytest.approx((first + 3) / 2)
    assert q[1, 0] == pytest.approx(second)
    assert squares[0, 4] == pytest.approx((first**2 + 9) / 2)
    assert visits.sum() == 3
    assert arriving == pytest.approx([0.75 * (first + 3) / 2, 5 + 0.25 * second])
    assert error == pytest.approx(first**2 + second**2 + (3 - first) ** 2)


def test_sums_by_row():
    values = np.arange(8, dtype=np.float32).reshape(4, 2)
    np.testing.assert_array_equal(added(values, np.array([1, 0, 1, 1], np.int32), 3), [[2, 3], [10, 13], [0, 0]])


def test_what_cells_borrow():
    """Two cells with one parent: (visits * mean + prior * parent) / (visits + prior). The parent borrows likewise, from the mean of all."""
    visits = np.array([[4, 0], [0, 2]], np.float32)
    means = np.array([[1, 0], [0, 5]], np.float32)
    everything = (4 * 1 + 2 * 5) / 6
    parent = [(4 * 1 + 2 * everything) / 6, (2 * 5 + 2 * everything) / 4]
    expected = [[(4 * 1 + 2 * parent[0]) / 6, parent[1]], [parent[0], (2 * 5 + 2 * parent[1]) / 4]]
    np.testing.assert_allclose(borrowed(means, visits, [(np.array([0, 0], np.int32), 1)], np.float32(2)), expected, rtol=1e-6)


def test_learning_waits_for_light():
    guide, dark = new_guide(), transitions(np.zeros((9, 3)), np.zeros(9), np.ones(9), np.zeros((9, 3)))
    guide.learn(dark)
    assert guide.directions().bsdf_fraction == 1
    assert guide.learn(dark._replace(reward=np.ones(9, np.float32)))["cells"] == 1
    assert guide.directions().bsdf_fraction == np.float32(0.3)


def test_a_table_that_forgot_all_light_has_no_cells_either():
    """Positive and negative rewards may sum to 0. Then the last table is dropped, because new cells would have no rows in it."""
    guide, here, there = new_guide(levels=1), [(0, 0, 0)], [(0.9, 0.9, 0.9)]
    guide.learn(transitions(here, [1.0], [0.0], here))
    assert len(guide.directions().cdf) == 1
    guide.learn(transitions(here, [-1.0], [0.0], here))
    guide.learn(transitions(there, [0.0], [0.0], there))
    assert not guide.directions().cells.rows.any()  # one cell for all states


@pytest.mark.parametrize("second_moment", [False, True])
@pytest.mark.parametrize("weights", ["radiance", "product"])
def test_table_holds_what_was_learnt(weights, second_moment):
    guide, n = new_guide(weights=weights, second_moment=second_moment, levels=1), 500
    rng = np.random.default_rng(1)
    guide.learn(transitions(rng.uniform(-1, 1, (n, 3)), rng.exponential(size=n), np.zeros(n), np.zeros((n, 3))))
    state = guide.state()
    learnt = np.sqrt(borrowed(state["squares"], state["visits"], [], np.float32(4))) if second_moment else guide.q()
    expected = (learnt + LEAST * learnt.mean(axis=1, keepdims=True)) * (COSINES if weights == "product" else 1)
    cdf = guide.directions().cdf
    assert len(cdf) == guide.cells.count > 3
    np.testing.assert_allclose(np.diff(cdf, axis=1, prepend=0), expected / expected.sum(axis=1, keepdims=True), atol=1e-6)
    np.testing.assert_array_equal(cdf[:, -1], 1)


def test_radiance_whose_square_is_infinite_leaves_directions():
    guide, n = new_guide(), 500
    rng = np.random.default_rng(1)
    bright = np.where(np.arange(n) % 3, 1.0, 3e38)
    for _ in range(2):
        with np.errstate(over="ignore"):
            guide.learn(transitions(rng.uniform(-1, 1, (n, 3)), bright, np.zeros(n), np.zeros((n, 3))))
    cdf = guide.directions().cdf
    assert np.isfinite(cdf).all()
    np.testing.assert_array_equal(cdf[:, -1], 1)


def test_no_patch_is_ruled_out():
    guide, n = new_guide(), 5000
    rng = np.random.default_rng(1)
    t = transitions(rng.uniform(-1, 1, (n, 3)), np.zeros(n), np.zeros(n), np.zeros((n, 3)))
    for _ in range(20):
        guide.learn(t._replace(reward=(t.direction[:, 0] > 0).astype(np.float32)))  # no light from one side
    assert np.diff(guide.directions().cdf, axis=1, prepend=0).min() > 0.2 * LEAST / N


@pytest.mark.parametrize("levels", [1, 5])
def test_two_states_learn_their_bellman_equations(levels):
    """In every direction, state 0 sees a wall of emission 1 and albedo 1/2 in state 1; state 1 sees a wall of emission 0 in state 0."""
    guide, n = new_guide(levels=levels, prior=1e-3), 4000
    here = np.arange(n) % 2
    positions = np.where(here[:, None], (0.9, 0.9, 0.9), (-0.9, -0.9, -0.9))
    for _ in range(50):
        guide.learn(transitions(positions, 1.0 - here, np.full(n, 0.5), positions[::-1].copy()))
    # positions[::-1] has the other state in each place: Q0 = 1 + Q1 / 2, Q1 = Q0 / 2. First values lose weight like 1 / passes.
    np.testing.assert_allclose(guide.q(), np.outer([4 / 3, 2 / 3], np.ones(N)), rtol=0.02)
