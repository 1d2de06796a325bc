"""Every sampler against its own density, by chi-squared and by quadrature."""

import numpy as np
import pytest

from blender_rl_guiding import sampling
from blender_rl_guiding.bsdf import diffuse
from blender_rl_guiding.guiding import directions as guide
from blender_rl_guiding.guiding.patches import mean_cosines, patch_of, sample_patch
from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.render.paths import workspace
from blender_rl_guiding.scene.camera import camera_rays, pinhole
from blender_rl_guiding.scene.lights import lights, sample_light
from tests import scenes
from tests.significance import assert_distributed, assert_uniform, hemisphere_counts, hemisphere_masses

N = 400_000
ROWS, COLUMNS = 4, 6
UP = (sampling.F(0), sampling.F(0), sampling.F(1))


def numbers(count: int = N, dimensions: int = 2, seed: int = 1) -> np.ndarray:
    """Uniform float32 numbers of numpy's own, so that a sampler is judged apart from the renderer's streams."""
    return np.random.default_rng(seed).random((count, dimensions), np.float32)


# --- warps -----------------------------------------------------------------------------------------------------------


@kernel
def draw_cosine(u, out):
    for i in range(len(u)):
        sampling.store(out, i, sampling.cosine_hemisphere(u[i, 0], u[i, 1]))


@kernel
def draw_diffuse(u, out):
    for i in range(len(u)):
        sampling.store(out, i, diffuse.sample(UP, u[i, 0], u[i, 1]))


@kernel
def diffuse_pdf(directions, out):
    for i in range(len(directions)):
        out[i] = diffuse.pdf(UP, sampling.vector(directions, i))


@pytest.mark.parametrize("draw", [draw_cosine, draw_diffuse])
def test_cosine_samples_follow_their_pdf(draw):
    directions = np.empty((N, 3), np.float32)
    draw(numbers(), directions)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)

    def pdf(wi: np.ndarray) -> np.ndarray:
        out = np.empty(len(wi), np.float32)
        diffuse_pdf(wi, out)
        return out

    masses = hemisphere_masses(pdf, 16, 16)
    assert masses.sum() == pytest.approx(1, abs=1e-6)
    assert_distributed(hemisphere_counts(directions, 16, 16), N * masses)


def test_nothing_is_reflected_from_below():
    below = (sampling.F(0.6), sampling.F(0), sampling.F(-0.8))
    assert diffuse.pdf(UP, below) == 0
    assert diffuse.evaluate(UP, UP, below) == (0, 0, 0)


def test_triangle_points_are_uniform_over_its_area():
    points = np.array([sampling.uniform_triangle(u, v) for u, v in numbers(100_000)])
    assert points.min() >= 0
    assert points.sum(axis=1).max() <= 1
    assert_uniform(unfold(points), 12)


def unfold(barycentric: np.ndarray) -> np.ndarray:
    """Points uniform in a triangle become uniform in the unit square: the squared distance from corner 0, and the way across."""
    s = barycentric.sum(axis=1)
    return np.stack([s * s, barycentric[:, 0] / s], axis=1).clip(0, 1)


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
    np.testing.assert_array_equal(found, chosen)  # 1e-3 keeps away from where rounding decides


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


# --- guide -----------------------------------------------------------------------------------------------------------


@kernel
def draw_guide(directions, row, u, out):
    for i in range(len(u)):
        sampling.store(out, i, guide.sample(directions, row, UP, u[i, 0], u[i, 1], u[i, 2], u[i, 3]))


@kernel
def guide_pdf(directions, row, wi, out):
    for i in range(len(wi)):
        out[i] = guide.pdf(directions, row, UP, sampling.vector(wi, i))


def made_up(bsdf_fraction: float) -> guide.Directions:
    """Cell 0: anything; 1: half of the patches never; 2: all in one patch; 3: all alike."""
    weights = np.random.default_rng(5).exponential(size=(4, ROWS * COLUMNS))
    weights[1, ::2] = 0
    weights[2] = np.arange(ROWS * COLUMNS) == 9
    weights[3] = 1
    cdf = weights.cumsum(axis=1)
    return guide.one_cell(bsdf_fraction)._replace(patch_rows=ROWS, patch_columns=COLUMNS, cdf=(cdf / cdf[:, -1:]).astype(np.float32))


@pytest.mark.parametrize("bsdf_fraction", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("row", [0, 1, 2, 3, guide.UNKNOWN])
def test_guided_samples_follow_the_full_mixture(row, bsdf_fraction):
    mixture, drawn = made_up(bsdf_fraction), np.empty((N, 3), np.float32)
    draw_guide(mixture, row, numbers(dimensions=4), drawn)

    def pdf(wi: np.ndarray) -> np.ndarray:
        out = np.empty(len(wi), np.float32)
        guide_pdf(mixture, row, wi, out)
        return out

    masses = hemisphere_masses(pdf, 3 * ROWS, 3 * COLUMNS)
    assert masses.sum() == pytest.approx(1, abs=1e-5)
    # Rounding puts a few samples of a patch's very edge on its other side, where a neighbour may be impossible.
    counts = hemisphere_counts(drawn, 3 * ROWS, 3 * COLUMNS)
    assert counts[masses == 0].sum() <= 5
    assert_distributed(np.where(masses > 0, counts, 0), N * masses)


def test_one_cell_guides_have_their_closed_forms():
    wi = (sampling.F(0.6), sampling.F(0), sampling.F(0.8))
    assert guide.pdf(guide.one_cell(0.0), 0, UP, wi) == pytest.approx(1 / (2 * np.pi))
    assert guide.pdf(guide.one_cell(1.0), 0, UP, wi) == pytest.approx(0.8 / np.pi)


# --- lights ----------------------------------------------------------------------------------------------------------


@kernel
def draw_lights(table, u, points, chosen):
    for i in range(len(u)):
        point, light = sample_light(table, u[i, 0], u[i, 1], u[i, 2])
        sampling.store(points, i, point)
        chosen[i] = light


def test_lights_are_uniform_by_area_and_weighted_by_luminance():
    b = scenes.Builder()
    b.quad((0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), scenes.material("bright", emission=(4.0, 2.0, 1.0)))
    b.quad((0, 0, 1), (1, 0, 1), (1, 1, 2), (0, 1, 2), scenes.material("dark"))
    b.quad((5, 0, 0), (5, 1, 0), (5, 1, 5), (5, 0, 5), scenes.material("blue", emission=(0.0, 0.0, 3.0)))
    scene = b.scene(scenes.look((9, 9, 9), (0, 0, 0), 40, 4, 4))
    table = lights(scene)
    corners = scene.vertices[scene.triangles[table.triangle]].astype(float)
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    pdf_area = table.pdf_area[scene.material[table.triangle]]
    assert (area * pdf_area).sum() == pytest.approx(1, abs=1e-6)
    assert table.pdf_area[1] == 0
    assert table.pdf_area[0] / table.pdf_area[2] == pytest.approx((4 * 0.2126 + 2 * 0.7152 + 0.0722) / (3 * 0.0722), rel=1e-5)
    points, chosen = np.empty((N, 3), np.float32), np.empty(N, np.int64)
    draw_lights(table, numbers(dimensions=3), points, chosen)
    assert_distributed(np.bincount(chosen, minlength=len(area)), N * area * pdf_area)
    for light, (a, b_, c) in enumerate(corners):
        edges = np.stack([b_ - a, c - a], axis=1)
        barycentric, residual, *_ = np.linalg.lstsq(edges, (points[chosen == light] - a).T)
        assert residual.max() < 1e-10
        assert_uniform(unfold(barycentric.T), 8)


# --- camera ----------------------------------------------------------------------------------------------------------


def project(camera: scenes.Camera, points: np.ndarray) -> np.ndarray:
    """Where world-space points appear, in pixels from the top left corner: the camera's definition, written the other way round."""
    local = (np.c_[points, np.ones(len(points))] @ np.linalg.inv(np.array(camera.to_world)).T)[:, :3]
    x, y = local[:, 0] / -local[:, 2] / camera.tan_x, local[:, 1] / -local[:, 2] / camera.tan_y
    return np.stack([(x + 1) / 2 * camera.width, (1 - y) / 2 * camera.height], axis=1)


def test_camera_rays_are_uniform_in_their_pixels():
    camera = scenes.look((1, -2, 0.5), (0.2, 0, 0.8), 50, 8, 5)
    scene, count, first = scenes.lit_quad(camera), 40 * 4000, 40 * 3
    paths = workspace(count, learning=False).paths[0]
    camera_rays(pinhole(scene), 7, 40, first, 10, count, paths)
    np.testing.assert_array_equal(paths.path, first + np.arange(count))
    np.testing.assert_array_equal(paths.throughput, 1)
    np.testing.assert_allclose(np.linalg.norm(paths.direction, axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(paths.origin, np.broadcast_to(np.array(camera.to_world)[:3, 3], (count, 3)), atol=1e-6)
    at = project(camera, paths.origin + paths.direction.astype(float))
    pixel = paths.path % 40
    inside = at - np.stack([pixel % 8, pixel // 8], axis=1)
    assert inside.min() > -1e-4
    assert inside.max() < 1 + 1e-4
    for chosen in range(40):
        assert_uniform(inside[pixel == chosen].clip(0, 1), 8)


def test_camera_rays_have_the_key_of_their_pixel_and_sample():
    paths = workspace(100, learning=False).paths[0]
    camera_rays(pinhole(scenes.lit_quad(scenes.look((0, -2, 0), (0, 0, 0), 50, 5, 4))), 7, 20, 60, 10, 100, paths)
    expected = [sampling.stream(7, path % 20, 10 + path // 20) for path in range(60, 160)]
    np.testing.assert_array_equal(paths.key, np.array(expected, np.uint64))
