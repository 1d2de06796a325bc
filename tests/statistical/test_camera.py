"""Camera rays of every lens, filter and aperture. The tests invert the camera's definition to get lens point and pixel of each ray."""

import math
from dataclasses import replace

import numpy as np
import pytest

from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.kernels.sampling import store
from blender_rl_guiding.scene.description import Camera, Film
from blender_rl_guiding.tracing.camera import camera_ray, lens
from tests import scenes
from tests.significance import assert_distributed, assert_uniform

N = 200_000
WIDTH, HEIGHT = 8, 5
PLAIN = scenes.look((1, -2, 0.5), (0.2, 0, 0.8), 50, WIDTH, HEIGHT)
SPHERE = (-math.pi, math.pi, -math.pi / 2, math.pi / 2)
LENSES = {
    "perspective": PLAIN,
    "shifted": replace(PLAIN, window=(-0.2, 0.7, 0.1, 0.5)),
    "orthographic": replace(PLAIN, kind="orthographic", window=(-3.0, 2.0, -1.0, 1.5)),
    "panorama": replace(PLAIN, kind="panorama", window=SPHERE),
    "part of a panorama": replace(PLAIN, kind="panorama", window=(-1.0, 0.5, -0.3, 0.8)),
    "thin lens": replace(PLAIN, aperture=0.3, focus=2.5),
    "five blades": replace(PLAIN, aperture=0.3, focus=2.5, blades=5, blade_rotation=0.4, aperture_ratio=2.0),
    "three blades": replace(PLAIN, aperture=0.1, focus=0.5, blades=3),
    "orthographic thin lens": replace(PLAIN, kind="orthographic", window=(-3.0, 2.0, -1.0, 1.5), aperture=0.3, focus=2.5),
}


@kernel
def draw_rays(of, pixels, u, origins, directions, spans):
    for i in range(len(u)):
        pixel = pixels[i]
        origin, direction, near, far = camera_ray(of, pixel % WIDTH, pixel // WIDTH, u[i, 0], u[i, 1], u[i, 2], u[i, 3])
        store(origins, i, origin)
        store(directions, i, direction)
        spans[i, 0], spans[i, 1] = near, far


def rays(camera: Camera, film: Film = Film(), seed: int = 1) -> tuple[np.ndarray, ...]:
    """N rays in camera space, through one pixel after another: (pixels, origins, unit directions, spans); vectors in float64."""
    scene = replace(scenes.lit_quad(camera), film=film)
    pixels, u = np.arange(N) % (WIDTH * HEIGHT), np.random.default_rng(seed).random((N, 4), np.float32)
    origins, directions, spans = np.empty((N, 3), np.float32), np.empty((N, 3), np.float32), np.empty((N, 2), np.float32)
    draw_rays(lens(scene), pixels, u, origins, directions, spans)
    matrix = np.array(camera.to_world)
    return pixels, (origins - matrix[:3, 3]) @ matrix[:3, :3], directions @ matrix[:3, :3], spans


def on_film(camera: Camera, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Places of rays in the window, in pixels from its top left corner. With a thin lens, the point in the plane of focus counts."""
    left, right, bottom, top = camera.window
    if camera.kind == "panorama":
        x, y = np.arctan2(directions[:, 0], -directions[:, 2]), np.arcsin(directions[:, 1].clip(-1, 1))
    else:
        sharp = origins + directions * ((-camera.focus - origins[:, 2]) / directions[:, 2])[:, None]
        x, y = sharp[:, :2].T / (camera.focus if camera.kind == "perspective" else 1)
    return np.stack([(x - left) / (right - left) * camera.width, (top - y) / (top - bottom) * camera.height], axis=1)


@pytest.mark.parametrize("name", LENSES)
def test_rays_are_uniform_in_their_pixels(name):
    camera = LENSES[name]
    pixels, origins, directions, _ = rays(camera)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)
    inside = on_film(camera, origins, directions) - np.stack([pixels % WIDTH, pixels // WIDTH], axis=1)
    assert inside.min() > -1e-4
    assert inside.max() < 1 + 1e-4
    for chosen in range(WIDTH * HEIGHT):
        assert_uniform(inside[pixels == chosen].clip(0, 1), 8)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
@pytest.mark.parametrize("near", [0.0, 0.25])
def test_clip_distances_are_measured_along_the_view_axis(kind, near):
    _, _, directions, spans = rays(replace(PLAIN, kind=kind, near=near, far=50.0))
    np.testing.assert_allclose(spans * -directions[:, 2:], np.broadcast_to([near, 50.0], spans.shape), rtol=1e-5)


def test_clip_distances_of_panoramas_are_measured_along_the_ray():
    _, _, _, spans = rays(replace(LENSES["panorama"], near=0.25, far=50.0))
    np.testing.assert_array_equal(spans, np.broadcast_to(np.float32([0.25, 50.0]), spans.shape))


# --- filters -----------------------------------------------------------------------------------------------------------


def gaussian(x: np.ndarray) -> np.ndarray:
    """Cycles' filter: a standard deviation of 1/12 if the table ends at +-1/2."""
    return np.exp(-2 * (6 * x) ** 2)


def blackman_harris(x: np.ndarray) -> np.ndarray:
    turn = 2 * np.pi * (x + 0.5)
    return 0.35875 - 0.48829 * np.cos(turn) + 0.14128 * np.cos(2 * turn) - 0.01168 * np.cos(3 * turn)


@pytest.mark.parametrize(("curve", "reach"), [(gaussian, 3), (blackman_harris, 2)])  # full reach, in filter widths
@pytest.mark.parametrize("width", [1.0, 2.5])
def test_samples_are_spread_by_the_filter(curve, reach, width):
    camera = LENSES["perspective"]
    pixels, origins, directions, _ = rays(camera, Film(curve.__name__, width))
    offset = (on_film(camera, origins, directions) - np.stack([pixels % WIDTH, pixels // WIDTH], axis=1) - 0.5) / (width * reach)
    assert np.abs(offset).max() < 0.5 + 1e-4
    bins, fine = 20, 200
    masses = curve((np.arange(bins * fine) + 0.5) / (bins * fine) - 0.5).reshape(bins, fine).sum(axis=1)
    masses /= masses.sum()
    counts = np.histogram2d(*offset.clip(-0.5, 0.5).T, bins=np.linspace(-0.5, 0.5, bins + 1))[0]
    assert_distributed(counts, N * np.outer(masses, masses))  # both axes together: they are independent


# --- apertures ---------------------------------------------------------------------------------------------------------


def on_lens(camera: Camera) -> np.ndarray:
    """Points (N, 2) where rays leave the lens, in units of its radius."""
    _, origins, directions, _ = rays(camera)
    if camera.kind == "orthographic":  # the lens moves with the pixel
        inside = on_film(camera, origins, directions) / (WIDTH, HEIGHT)
        left, right, bottom, top = camera.window
        origins[:, :2] -= inside * (right - left, bottom - top) + (left, top)
    assert np.abs(origins[:, 2]).max() < 1e-6
    return origins[:, :2] * (camera.aperture_ratio, 1) / camera.aperture


@pytest.mark.parametrize("name", ["thin lens", "orthographic thin lens"])
def test_round_apertures_are_discs(name):
    x, y = on_lens(LENSES[name]).T
    squared, turn = x * x + y * y, np.arctan2(y, x) / (2 * np.pi) % 1
    assert squared.max() < 1 + 1e-4
    assert_uniform(np.stack([squared, turn], axis=1).clip(0, 1), 20)


@pytest.mark.parametrize("name", ["three blades", "five blades"])
def test_blades_make_a_regular_polygon(name):
    """Sampling is uniform in the triangle of each side. So squared distance towards the side and position along it are uniform."""
    camera = LENSES[name]
    x, y = on_lens(camera).T
    step = 2 * np.pi / camera.blades
    sector, turn = np.divmod((np.arctan2(y, x) - camera.blade_rotation) % (2 * np.pi), step)
    apothem, radius = math.cos(step / 2), np.hypot(x, y)
    towards = radius * np.cos(turn - step / 2) / apothem
    along = radius * np.sin(turn - step / 2) / (towards * apothem * math.tan(step / 2))
    assert towards.max() < 1 + 1e-4
    place = np.stack([towards**2, (along + 1) / 2, sector], axis=1)
    counts, _ = np.histogramdd(place.clip(0, (1, 1, camera.blades)), bins=[10, 10, np.arange(camera.blades + 1)])
    assert_distributed(counts, np.full(counts.shape, N / counts.size))
