"""The pinhole sees every point where Blender's own camera sees it."""

from collections.abc import Callable

import bpy
import mathutils  # pyright: ignore[reportMissingImports]  # a part of bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view  # pyright: ignore[reportMissingImports]  # a part of bpy

from blender_rl_guiding.scene.data import Camera, SceneData

Export = Callable[[], SceneData]
POINTS = np.random.default_rng(3).uniform(-1, 1, (20, 3)) + np.array([0, 5, 0])


@pytest.fixture
def camera(scene: bpy.types.Scene) -> bpy.types.Object:
    bpy.ops.mesh.primitive_cube_add(location=(0, 5, 0))
    scene.camera.rotation_euler = (1.4, 0.1, 0.2)
    scene.camera.location = (0.3, -0.2, 0.1)
    return scene.camera


def film_position(camera: Camera, point: np.ndarray) -> tuple[float, float]:
    """From 0, 0 at the bottom left to 1, 1 at the top right."""
    to_world = np.array(camera.to_world)
    x, y, z = to_world[:3, :3].T @ (point - to_world[:3, 3])
    return 0.5 - 0.5 * x / z / camera.tan_x, 0.5 - 0.5 * y / z / camera.tan_y


def assert_agrees(run: Export, scene: bpy.types.Scene) -> None:
    camera = run().camera
    bpy.context.view_layer.update()
    for point in POINTS:
        assert film_position(camera, point) == pytest.approx(
            world_to_camera_view(scene, scene.camera, mathutils.Vector(point))[:2], abs=1e-5
        )


@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize("resolution", [(32, 18), (18, 32), (20, 20)])
def test_landscape_and_portrait(run: Export, scene: bpy.types.Scene, camera: bpy.types.Object, resolution: tuple[int, int], fit: str):
    scene.render.resolution_x, scene.render.resolution_y = resolution
    camera.data.sensor_fit, camera.data.lens = fit, 35
    assert_agrees(run, scene)
    exported = run().camera
    assert (exported.width, exported.height) == resolution
    matrix = camera.calc_matrix_camera(bpy.context.evaluated_depsgraph_get(), x=resolution[0], y=resolution[1])
    assert (1 / exported.tan_x, 1 / exported.tan_y) == pytest.approx((matrix[0][0], matrix[1][1]), rel=1e-6)


@pytest.mark.parametrize("aspect", [(2, 1), (1, 3)])
def test_pixels_that_are_not_square(run: Export, scene: bpy.types.Scene, camera: bpy.types.Object, aspect: tuple[int, int]):
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
    assert_agrees(run, scene)


def test_a_scaled_parent_does_not_change_what_is_seen(run: Export, scene: bpy.types.Scene, camera: bpy.types.Object):
    camera.parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(camera.parent)
    camera.parent.scale = (2, 2, 2)
    assert_agrees(run, scene)
    assert np.linalg.det(np.array(run().camera.to_world)[:3, :3]) == pytest.approx(1, abs=1e-5)


def test_the_percentage_scales_the_resolution(run: Export, scene: bpy.types.Scene, camera: bpy.types.Object):
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 100, 60, 50
    assert_agrees(run, scene)
    scene.render.resolution_x = 101  # half a pixel is none, as in every engine
    assert (run().camera.width, run().camera.height) == (50, 30)
