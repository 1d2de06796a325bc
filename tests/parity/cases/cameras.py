"""Cameras and films: the direction of every pixel. Each object emits its own colour, so only edges have noise."""

from __future__ import annotations

from math import radians
from typing import TYPE_CHECKING, Any

from .registry import CHART, case, each

if TYPE_CHECKING:
    from ..stage import Stage

SHAPES = {"landscape": (32, 20), "portrait": (20, 32)}


def glowing_set(s: Stage) -> None:
    s.set(s.glow)
    s.sky((0.1, 0.2, 0.1))


@each(
    {f"{fit.lower()}_{shape}": (fit, *size) for fit in ("AUTO", "HORIZONTAL", "VERTICAL") for shape, size in SHAPES.items()}, samples=CHART
)
def sensor_fit(s: Stage, variant: tuple[str, int, int]) -> None:
    glowing_set(s)
    fit, width, height = variant
    s.camera.data.sensor_fit, s.camera.data.sensor_width, s.camera.data.sensor_height = fit, 36.0, 20.0
    s.size(width, height)


@each(SHAPES, samples=CHART)
def shift(s: Stage, size: tuple[int, int]) -> None:
    glowing_set(s)
    s.camera.data.shift_x, s.camera.data.shift_y = 0.15, -0.1
    s.size(*size)


@each(SHAPES, samples=CHART)
def orthographic(s: Stage, size: tuple[int, int]) -> None:
    glowing_set(s)
    s.camera.data.type, s.camera.data.ortho_scale, s.camera.data.shift_x = "ORTHO", 5.0, 0.1
    s.size(*size)


@each({"whole": {}, "part": {"longitude_min": -1.0, "longitude_max": 2.0, "latitude_min": -1.2, "latitude_max": 0.6}}, samples=CHART)
def panorama(s: Stage, attributes: dict[str, float]) -> None:
    glowing_set(s)
    s.camera.location = (0.1, -1.3, 1.1)
    s.camera.rotation_euler = (1.4, 0.1, 0.3)
    s.camera.data.type, s.camera.data.panorama_type = "PANO", "EQUIRECTANGULAR"
    for name, value in attributes.items():
        setattr(s.camera.data, name, value)
    s.size(32, 16)


@case(samples=CHART)
def field_of_view_in_degrees(s: Stage) -> None:
    glowing_set(s)
    s.camera.data.lens_unit, s.camera.data.angle = "FOV", radians(65)


@case(samples=CHART)
def camera_scaled(s: Stage) -> None:
    glowing_set(s)
    s.camera.scale = (2.0, 0.5, 3.0)


@case(samples=CHART)
def camera_in_a_parent(s: Stage) -> None:
    glowing_set(s)
    s.camera.parent = s.place("Parent", None, (0.3, -0.5, 0.2), rotation_euler=(0.1, 0.1, 0.2), scale=(1.2, 1.2, 1.2))


BLADES = {"aperture_blades": 5, "aperture_rotation": radians(20)}


@each(
    {
        "round": {},
        "of_5_blades": BLADES,
        "squeezed": {"aperture_ratio": 2.0},
        "stretched_with_blades": {"aperture_ratio": 0.6} | BLADES,
    },
    samples=CHART,
)
def depth_of_field(s: Stage, attributes: dict[str, Any]) -> None:
    glowing_set(s)
    dof = s.camera.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, 4.0, 0.05
    for name, value in attributes.items():
        setattr(dof, name, value)


@case(samples=CHART)
def depth_of_field_at_an_object(s: Stage) -> None:
    glowing_set(s)
    dof = s.camera.data.dof
    dof.use_dof, dof.aperture_fstop = True, 0.05
    dof.focus_object = s.place("Focus", None, (1.0, 2.5, 0.3))


@case(samples=CHART)
def depth_of_field_orthographic(s: Stage) -> None:
    glowing_set(s)
    s.camera.data.type, s.camera.data.ortho_scale = "ORTHO", 5.0
    dof = s.camera.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, 4.0, 2.0


@case(samples=CHART)
def depth_of_field_panorama(s: Stage) -> None:
    panorama(s, {})
    dof = s.camera.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, 1.0, 0.2


@each({"start": {"clip_start": 5.9}, "end": {"clip_end": 6.9}}, samples=CHART)
def clip(s: Stage, attributes: dict[str, float]) -> None:
    glowing_set(s)
    for name, value in attributes.items():
        setattr(s.camera.data, name, value)


@case(samples=CHART)
def clip_orthographic(s: Stage) -> None:
    glowing_set(s)
    data = s.camera.data
    data.type, data.ortho_scale, data.clip_start, data.clip_end = "ORTHO", 5.0, 5.6, 6.8


@case(samples=CHART)
def clip_panorama(s: Stage) -> None:
    panorama(s, {})
    s.camera.data.clip_start, s.camera.data.clip_end = 0.9, 4.0


@case(samples=96)
def clipping_does_not_change_light(s: Stage) -> None:
    s.set()
    s.lamp("AREA", size=1.5)
    s.camera.data.clip_start = 5.9


@each({"wide": (2.0, 1.0), "tall": (1.0, 1.5)}, samples=CHART)
def pixel_aspect(s: Stage, aspect: tuple[float, float]) -> None:
    glowing_set(s)
    s.scene.render.pixel_aspect_x, s.scene.render.pixel_aspect_y = aspect


@each(
    {"blackman_harris": ("BLACKMAN_HARRIS", 1.5), "wide_blackman_harris": ("BLACKMAN_HARRIS", 4.0), "gaussian": ("GAUSSIAN", 2.0)},
    samples=CHART,
)
def pixel_filter(s: Stage, variant: tuple[str, float]) -> None:
    glowing_set(s)
    s.scene.cycles.pixel_filter_type, s.scene.cycles.filter_width = variant


@case(samples=CHART)
def region_cropped(s: Stage) -> None:
    glowing_set(s)
    render = s.scene.render
    s.size(40, 36)
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.2, 0.8, 0.1, 0.71


@case(samples=CHART)
def resolution_percentage(s: Stage) -> None:
    glowing_set(s)
    s.size(51, 47)
    s.scene.render.resolution_percentage = 55
