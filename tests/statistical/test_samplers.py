"""Warps, patches and the guide's table: samples follow the density, by chi-squared and quadrature."""

import numpy as np
import pytest

from blender_rl_guiding.guiding import mixture
from blender_rl_guiding.guiding.directions import Directions, one_cell
from blender_rl_guiding.guiding.patches import mean_cosines, patch_of, sample_patch
from blender_rl_guiding.kernels import kernel, sampling
from blender_rl_guiding.kernels.sampling import F
from tests.significance import assert_distributed, assert_uniform, hemisphere_counts, hemisphere_masses

N = 400_000
ROWS, COLUMNS = 4, 6


def numbers(count: int = N, dimensions: int = 2, seed: int = 1) -> np.ndarray:
    """NumPy's uniform numbers, float32: tests of samplers do not depend on the renderer's streams."""
    return np.random.default_rng(seed).random((count, dimensions), np.float32)


# --- warps -----------------------------------------------------------------------------------------------------------


@kernel
def draw_cosine(u, out):
    for i in range(len(u)):
        sampling.store(out, i, sampling.cosine_hemisphere(u[i, 0], u[i, 1]))


@kernel
def draw_triangle(u, out):
    for i in range(len(u)):
        out[i, 0], out[i, 1] = sampling.uniform_triangle(u[i, 0], u[i, 1])


def test_cosine_samples_follow_the_cosine():
    directions = np.empty((N, 3), np.float32)
    draw_cosine(numbers(), directions)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)
    masses = hemisphere_masses(lambda wi: wi[:, 2] / np.pi, 16, 16)
    assert masses.sum() == pytest.approx(1, abs=1e-6)
    assert_distributed(hemisphere_counts(directions, 16, 16), N * masses)


def test_triangle_points_are_uniform_over_its_area():
    points = np.empty((N, 2), np.float32)
    draw_triangle(numbers(), points)
    assert points.min() >= 0
    assert points.sum(axis=1).max() <= 1
    s = points.sum(axis=1)
    assert_uniform(np.stack([s * s, points[:, 0] / s], axis=1).clip(0, 1), 12)  # squared distance from corner 0, and position across


# --- patches ---------------------------------------------------------------------------------------------------------


@kernel
def patches(rows, columns, directions, out):
    for i in range(len(directions)):
        out[i] = patch_of(rows, columns, sampling.vector(directions, i))


@kernel
def draw_patch(rows, columns, patch, u, out):
    for i in range(len(u)):
        sampling.store(out, i, sample_patch(rows, columns, patch[i], u[i, 0], u[i, 1]))


@pytest.mark.parametrize(("rows", "columns"), [(1, 2), (4, 6), (12, 18), (15, 20)])
def test_patches_have_equal_solid_angles(rows, columns):
    z, turn = numbers().astype(float).T
    r, phi = np.sqrt(1 - z * z), 2 * np.pi * turn
    found = np.empty(N, np.int64)
    patches(rows, columns, np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1).astype(np.float32), found)
    assert_distributed(np.bincount(found, minlength=rows * columns), np.full(rows * columns, N / (rows * columns)))


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (4, 6), (12, 18), (15, 20)])
def test_a_direction_drawn_in_a_patch_lies_in_it(rows, columns):
    chosen = np.arange(N) % (rows * columns)
    u, directions, found = 1e-3 + 0.998 * numbers(), np.empty((N, 3), np.float32), np.empty(N, np.int64)
    draw_patch(rows, columns, chosen, u, directions)
    patches(rows, columns, directions, found)
    np.testing.assert_array_equal(found, chosen)  # with a margin of 1e-3 to the edges, where rounding decides


def test_directions_are_uniform_within_their_patch():
    directions = np.empty((N, 3), np.float32)
    draw_patch(ROWS, COLUMNS, np.full(N, 13), numbers(), directions)
    z, turn = directions[:, 2], np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi)
    assert_uniform(np.stack([z * ROWS - 2, turn * COLUMNS - 1], axis=1).clip(0, 1), 16)  # patch 13: row 2, column 1


def test_mean_cosine_of_each_patch():
    def cosine(wi: np.ndarray) -> np.ndarray:
        return wi[:, 2]

    mean = hemisphere_masses(cosine, ROWS, COLUMNS) * ROWS * COLUMNS / (2 * np.pi)
    np.testing.assert_allclose(mean_cosines(ROWS, COLUMNS).reshape(ROWS, COLUMNS), mean, rtol=1e-6)


# --- the guide's table ---------------------------------------------------------------------------------------------------


@kernel
def draw_table(directions, row, u, out):
    up = F(0), F(0), F(1)
    for i in range(len(u)):
        found = mixture.Found(F(0), F(1), row)
        sampling.store(out, i, mixture.sample(directions, found, up, up, u[i, 0], u[i, 1], u[i, 2]))


@kernel
def table_pdf(directions, row, wi, out):
    up = F(0), F(0), F(1)
    for i in range(len(wi)):
        out[i] = mixture.pdf(directions, mixture.Found(F(0), F(1), row), up, up, sampling.vector(wi, i), F(0), F(0))


def pdf_of(directions: Directions, row: int, wi: np.ndarray) -> np.ndarray:
    out = np.empty(len(wi), np.float32)
    table_pdf(directions, row, wi, out)
    return out


def made_up() -> Directions:
    """A table of four cells. Weights of patches: cell 0, random; cell 1, half of them 0; cell 2, all but one 0; cell 3, equal."""
    weights = np.random.default_rng(5).exponential(size=(4, ROWS * COLUMNS))
    weights[1, ::2] = 0
    weights[2] = np.arange(ROWS * COLUMNS) == 9
    weights[3] = 1
    cdf = weights.cumsum(axis=1)
    return one_cell(0.0)._replace(patch_rows=ROWS, patch_columns=COLUMNS, cdf=(cdf / cdf[:, -1:]).astype(np.float32))


@pytest.mark.parametrize("row", range(4))
def test_guided_samples_follow_the_table(row):
    table, drawn = made_up(), np.empty((N, 3), np.float32)
    draw_table(table, row, numbers(dimensions=3), drawn)
    np.testing.assert_allclose(np.linalg.norm(drawn, axis=1), 1, atol=1e-6)
    masses = hemisphere_masses(lambda wi: pdf_of(table, row, wi), 3 * ROWS, 3 * COLUMNS)
    assert masses.sum() == pytest.approx(1, abs=1e-5)
    # Rounding moves a few samples into a neighbouring patch, whose probability may be 0.
    counts = hemisphere_counts(drawn, 3 * ROWS, 3 * COLUMNS)
    assert counts[masses == 0].sum() <= 5
    assert_distributed(np.where(masses > 0, counts, 0), N * masses)


def test_nothing_is_guided_below_the_horizon():
    wi = np.array([(0.6, 0, -0.8), (1, 0, 0), (0, 0, -1)], np.float32)
    assert not pdf_of(made_up(), 0, wi).any()


def test_one_cell_is_the_hemisphere():
    wi = np.array([(0.6, 0, 0.8), (0, -0.8, 0.6)], np.float32)
    np.testing.assert_allclose(pdf_of(one_cell(0.0), 0, wi), 1 / (2 * np.pi), rtol=1e-6)
