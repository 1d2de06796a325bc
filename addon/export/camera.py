"""The scene's camera as a pinhole."""

from collections.abc import Iterator

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import Camera, Loss


def read_camera(depsgraph: bpy.types.Depsgraph) -> tuple[Camera, list[Loss]]:
    """Follows sensor fit, pixel aspect and resolution as Cycles does. InputError without a camera."""
    scene = depsgraph.scene
    if not scene.camera or scene.camera.type != "CAMERA":
        raise InputError(f"scene '{scene.name}' has no camera (Properties > Scene > Camera)")
    thing = scene.camera.evaluated_get(depsgraph)
    render = scene.render
    width = render.resolution_x * render.resolution_percentage // 100
    height = render.resolution_y * render.resolution_percentage // 100
    tan_x, tan_y = _film(thing.data, width * render.pixel_aspect_x, height * render.pixel_aspect_y)
    to_world = tuple(tuple(row) for row in thing.matrix_world.normalized())
    losses = [Loss(thing.name, "camera", detail) for detail in _losses(thing.data)]
    return Camera(to_world, tan_x, tan_y, width, height), losses


def _film(data: bpy.types.Camera, width: float, height: float) -> tuple[float, float]:
    """Half the film's width and height at distance 1. With AUTO the sensor's width spans the longer side of the image."""
    sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    tan = sensor / (2.0 * data.lens)
    if data.sensor_fit == "HORIZONTAL" or (data.sensor_fit == "AUTO" and width > height):
        return tan, tan * height / width
    return tan * width / height, tan


def _losses(data: bpy.types.Camera) -> Iterator[str]:
    if data.type != "PERSP":
        yield f"type {data.type}: a perspective camera of {data.lens:g} mm stands in"
    if data.shift_x or data.shift_y:
        yield f"shift ({data.shift_x:g}, {data.shift_y:g}): the image is centred"
    if data.dof.use_dof:
        yield "depth of field: everything is in focus"
