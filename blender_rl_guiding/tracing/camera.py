"""Camera rays: the lens, the film and its pixel filter."""

import math
from typing import NamedTuple, get_args

import numpy as np

from ..kernels import part
from ..kernels.sampling import TWO_PI, F, add, circle, normalize, pick, scale, subtract
from ..scene.data import SceneData
from ..scene.description import CameraKind

_KINDS = get_args(CameraKind)
PERSPECTIVE, ORTHOGRAPHIC, PANORAMA, HEMISPHERE = range(len(_KINDS))
_FILTERS = {"box": 1.0, "blackman_harris": 2.0, "gaussian": 3.0}  # width that Cycles samples / width in the settings
_FILTER_CELLS = 1024


class Lens(NamedTuple):
    """A camera as arrays and numbers for the kernels."""

    kind: int
    axes: np.ndarray  # (4, 3) float32: right, up, backward, position from the scene's origin
    corner: tuple[np.float32, np.float32]  # top left corner of the window
    pixel: tuple[np.float32, np.float32]  # width and height of a pixel in the window; y runs down
    near: np.float32
    far: np.float32
    aperture: np.float32
    focus: np.float32
    blades: int
    blade_rotation: np.float32
    aperture_ratio: np.float32
    filter: np.ndarray  # (1, n) float32, cumulative distribution of the pixel filter, in n steps over its width
    filter_width: np.float32  # pixels


def lens(scene: SceneData) -> Lens:
    """The scene's camera for `camera_ray`."""
    camera, film = scene.camera, scene.film
    axes = np.array(camera.to_world, np.float64)[:3].T
    axes[3] -= scene.origin
    left, right, bottom, top = camera.window
    cdf = filter_cdf(film.filter)
    width = film.filter_width * _FILTERS[film.filter]
    return Lens(
        _KINDS.index(camera.kind),
        np.ascontiguousarray(axes, np.float32),
        (F(left), F(top)),
        (F((right - left) / camera.width), F((bottom - top) / camera.height)),
        F(camera.near),
        F(camera.far),
        F(camera.aperture),
        F(camera.focus),
        camera.blades,
        F(camera.blade_rotation),
        F(camera.aperture_ratio),
        cdf,
        F(width),
    )


def filter_cdf(kind: str) -> np.ndarray:
    """The cumulative distribution of sample offsets along one axis, (1, n) float32, in n equal steps over the filter's width."""
    x = (np.arange(_FILTER_CELLS) + 0.5) / _FILTER_CELLS
    if kind == "gaussian":
        weight = np.exp(-2 * (6 * (x - 0.5)) ** 2)
    elif kind == "blackman_harris":
        weight = 0.35875 - 0.48829 * np.cos(2 * np.pi * x) + 0.14128 * np.cos(4 * np.pi * x) - 0.01168 * np.cos(6 * np.pi * x)
    else:
        weight = np.ones(1)
    cdf = np.cumsum(weight)
    return (cdf / cdf[-1]).astype(np.float32)[None, :]


@part
def _filtered(lens, u):
    """A sample's offset from the pixel's centre, pixels. The density is the filter, so all samples have the same weight."""
    cells = lens.filter.shape[1]
    cell = pick(lens.filter, 0, cells, u)
    below = lens.filter[0, cell - 1] if cell > 0 else F(0)
    inside = (u - below) / (lens.filter[0, cell] - below)
    return ((F(cell) + inside) / F(cells) - F(0.5)) * lens.filter_width


@part
def _aperture(lens, u, v):
    """A uniform point on an aperture of radius 1: a disc, or a regular polygon with `blades` corners."""
    if lens.blades < 3:
        r, (x, y) = math.sqrt(u), circle(v)
        return r * x, r * y
    # Pick a triangle between the centre and two neighbouring corners.
    corner = np.floor(u * F(lens.blades))
    u = u * F(lens.blades) - corner
    r = math.sqrt(u)
    step = TWO_PI / F(lens.blades)
    a, b = F(1) - r, v * r  # barycentric coordinates of the centre and the second corner
    c = F(1) - a - b
    first, second = lens.blade_rotation + corner * step, lens.blade_rotation + (corner + F(1)) * step
    return b * math.cos(second) + c * math.cos(first), b * math.sin(second) + c * math.sin(first)


@part
def _to_world(lens, p):
    a = lens.axes
    return (
        a[0, 0] * p[0] + a[1, 0] * p[1] + a[2, 0] * p[2],
        a[0, 1] * p[0] + a[1, 1] * p[1] + a[2, 1] * p[2],
        a[0, 2] * p[0] + a[1, 2] * p[1] + a[2, 2] * p[2],
    )


@part
def camera_ray(lens, px, py, u, v, lens_u, lens_v):
    """A ray through pixel (px, py): (origin relative to the scene's origin, unit direction, nearest distance, farthest distance).

    u, v pick a point in the pixel's filter. lens_u, lens_v pick a point on the aperture. All four are uniform in [0, 1).
    """
    x = lens.corner[0] + (F(px) + F(0.5) + _filtered(lens, u)) * lens.pixel[0]
    y = lens.corner[1] + (F(py) + F(0.5) + _filtered(lens, v)) * lens.pixel[1]
    position = (lens.axes[3, 0], lens.axes[3, 1], lens.axes[3, 2])
    if lens.kind == PANORAMA:
        direction = (math.sin(x) * math.cos(y), math.sin(y), -math.cos(x) * math.cos(y))
        return position, _to_world(lens, direction), lens.near, lens.far
    if lens.kind == HEMISPHERE:
        a, b = circle(x)
        sine = math.sqrt(max(F(0), F(1) - y * y))
        return position, _to_world(lens, (a * sine, b * sine, y)), lens.near, lens.far
    start, direction = (F(0), F(0), F(0)), (x, y, F(-1))
    if lens.kind == ORTHOGRAPHIC:
        start, direction = (x, y, F(0)), (F(0), F(0), F(-1))
    if lens.aperture > F(0):
        sharp = add(start, scale(direction, lens.focus))
        a, b = _aperture(lens, lens_u, lens_v)
        start = add(start, (a * lens.aperture / lens.aperture_ratio, b * lens.aperture, F(0)))
        direction = subtract(sharp, start)
    direction = normalize(direction)
    along = F(-1) / direction[2]
    return add(position, _to_world(lens, start)), _to_world(lens, direction), lens.near * along, lens.far * along
