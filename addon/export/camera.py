"""The scene's camera, as Cycles understands it."""

from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.description import Camera, CameraKind, Loss

from ..neutral import panorama_of
from .coverage import CROPPED

_KINDS: dict[str, CameraKind] = {"PERSP": "perspective", "ORTHO": "orthographic", "PANO": "panorama"}
_NEAREST_FOCUS = 1e-6  # metres; with focus distance 0 the rays would have no directions


def read_camera(depsgraph: bpy.types.Depsgraph, *, whole: bool = False) -> tuple[Camera, list[Loss]]:
    """The camera with Cycles' rules for sensor fit, shift, pixel aspect, resolution and render region. `whole` ignores the region.

    InputError without a camera.
    """
    scene = depsgraph.scene
    if not scene.camera or scene.camera.type != "CAMERA":
        raise InputError(f"scene '{scene.name}' has no camera (Properties > Scene > Camera)")
    thing, render = scene.camera.evaluated_get(depsgraph), scene.render
    data = thing.data
    width, height = frame_size(render)
    region = (0, width, 0, height) if whole else region_of(render)
    kind = _kind(data)
    window = _window(data, kind, width * render.pixel_aspect_x, height * render.pixel_aspect_y)
    camera = Camera(
        tuple(tuple(row) for row in thing.matrix_world.normalized()),
        _part(window, region, width, height),
        region[1] - region[0],
        region[3] - region[2],
        kind,
        near=data.clip_start,
        far=data.clip_end,
        **(_lens(thing, kind, depsgraph) if data.dof.use_dof else {}),
    )
    return camera, [Loss(thing.name, "camera", detail) for detail in _losses(data, kind, render)]


def _kind(data: bpy.types.Camera) -> CameraKind:
    """The kind of a camera; perspective for unsupported cameras: fisheyes, cylinders, OSL."""
    if data.type == "PANO" and panorama_of(data).panorama_type != "EQUIRECTANGULAR":
        return "perspective"
    return _KINDS.get(data.type, "perspective")


def _window(data: bpy.types.Camera, kind: str, width: float, height: float) -> tuple[float, float, float, float]:
    """`Camera.window` of the whole frame. With AUTO the sensor's width spans the longer side of the image."""
    if kind == "panorama":
        return _sphere_window(data)
    across = data.sensor_fit == "HORIZONTAL" or (data.sensor_fit == "AUTO" and width > height)
    sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    span = data.ortho_scale if kind == "orthographic" else sensor / data.lens  # length of the image's side that fits the sensor
    x, y = (span / 2, span / 2 * height / width) if across else (span / 2 * width / height, span / 2)
    right, up = data.shift_x * span, data.shift_y * span  # both in units of that side
    return right - x, right + x, up - y, up + y


def _sphere_window(data: bpy.types.Camera) -> tuple[float, float, float, float]:
    """Longitudes to the left and right, latitudes at the bottom and top; a shift of 1 is the whole image."""
    settings = panorama_of(data)
    longitude, latitude = settings.longitude_max - settings.longitude_min, settings.latitude_max - settings.latitude_min
    left, bottom = settings.longitude_min + data.shift_x * longitude, settings.latitude_min + data.shift_y * latitude
    return left, left + longitude, bottom, bottom + latitude


def frame_size(render: bpy.types.RenderSettings) -> tuple[int, int]:
    """Width and height of the whole frame, in pixels."""
    return render.resolution_x * render.resolution_percentage // 100, render.resolution_y * render.resolution_percentage // 100


def region_of(render: bpy.types.RenderSettings) -> tuple[int, int, int, int]:
    """The pixels to render: first and end column from the left, first and end row from the bottom, rounded as Blender rounds them."""
    width, height = frame_size(render)
    if not render.use_border:
        return 0, width, 0, height
    edges = (render.border_min_x, width), (render.border_max_x, width), (render.border_min_y, height), (render.border_max_y, height)
    left, right, bottom, top = (int(np.float32(share) * np.float32(pixels)) for share, pixels in edges)
    return left, right, bottom, top


def _part(window: tuple[float, ...], region: tuple[int, ...], width: int, height: int) -> tuple[float, float, float, float]:
    """The window of a region."""
    left, right, bottom, top = window
    x, y = (right - left) / width, (top - bottom) / height
    return left + region[0] * x, left + region[1] * x, bottom + region[2] * y, bottom + region[3] * y


def _lens(thing: bpy.types.Object, kind: str, depsgraph: bpy.types.Depsgraph) -> dict[str, Any]:
    """Depth of field. As in Cycles, an orthographic camera has a lens with a focal length of 1 m."""
    dof = thing.data.dof
    focal_length = 1.0 if kind == "orthographic" else thing.data.lens * 1e-3
    return {
        "aperture": focal_length / (2 * max(dof.aperture_fstop, 1e-5)),
        "focus": max(_focus(thing, dof, depsgraph), _NEAREST_FOCUS),
        "blades": dof.aperture_blades if dof.aperture_blades >= 3 else 0,
        "blade_rotation": dof.aperture_rotation,
        "aperture_ratio": dof.aperture_ratio,
    }


def _focus(thing: bpy.types.Object, dof: bpy.types.CameraDOFSettings, depsgraph: bpy.types.Depsgraph) -> float:
    """Distance of the plane in focus. If there is a focus object, the plane contains the object's origin, or the origin of its bone."""
    if not dof.focus_object:
        return dof.focus_distance
    target = dof.focus_object.evaluated_get(depsgraph)
    place = target.matrix_world
    if target.pose and dof.focus_subtarget in target.pose.bones:
        place = place @ target.pose.bones[dof.focus_subtarget].matrix
    axis = thing.matrix_world.col[2].to_3d().normalized()
    return abs(axis.dot(thing.matrix_world.translation - place.translation))


def _losses(data: bpy.types.Camera, kind: str, render: bpy.types.RenderSettings) -> Iterator[str]:
    if kind != _KINDS.get(data.type):
        name = panorama_of(data).panorama_type if data.type == "PANO" else data.type
        yield f"type {name}: a perspective camera of {data.lens:g} mm stands in"
    if render.use_border and not render.use_crop_to_border:
        yield CROPPED
