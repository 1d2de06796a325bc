"""The exported camera projects every point as Blender's camera does, and its rays have Cycles' directions."""

import math
from collections.abc import Callable
from pathlib import Path

import bpy
import mathutils  # pyright: ignore[reportMissingImports]  # a part of bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view  # pyright: ignore[reportMissingImports]  # a part of bpy

from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import Bounces, Camera, Film

Export = Callable[[], SceneData]
POINTS = np.random.default_rng(3).uniform(-1, 1, (20, 3)) + np.array([0, 5, 0])
SHIFT = 10.0  # added, because light cannot be negative


@pytest.fixture
def camera(scene: bpy.types.Scene) -> bpy.types.Object:
    bpy.ops.mesh.primitive_cube_add(location=(0, 5, 0))
    scene.camera.rotation_euler = (1.4, 0.1, 0.2)
    scene.camera.location = (0.3, -0.2, 0.1)
    return scene.camera


def film_position(camera: Camera, point: np.ndarray) -> tuple[float, float]:
    """Place of a point in the picture: (0, 0) bottom left, (1, 1) top right."""
    to_world = np.array(camera.to_world)
    x, y, z = to_world[:3, :3].T @ (point - to_world[:3, 3])
    distance = -z if camera.kind == "perspective" else 1.0
    left, right, bottom, top = camera.window
    return (x / distance - left) / (right - left), (y / distance - bottom) / (top - bottom)


def assert_agrees(run: Export, scene: bpy.types.Scene) -> None:
    camera = run().camera
    bpy.context.view_layer.update()
    for point in POINTS:
        assert film_position(camera, point) == pytest.approx(
            world_to_camera_view(scene, scene.camera, mathutils.Vector(point))[:2], abs=1e-5
        )


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize("resolution", [(32, 18), (18, 32), (20, 20)])
def test_landscape_and_portrait(run: Export, scene: bpy.types.Scene, camera: bpy.types.Object, resolution: tuple, fit: str, kind: str):
    scene.render.resolution_x, scene.render.resolution_y = resolution
    camera.data.type, camera.data.sensor_fit, camera.data.lens = kind, fit, 35
    camera.data.shift_x, camera.data.shift_y = 0.3, -0.2
    assert_agrees(run, scene)
    exported = run().camera
    assert (exported.width, exported.height) == resolution


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("aspect", [(2, 1), (1, 3)])
def test_pixels_that_are_not_square(run: Export, scene: bpy.types.Scene, camera: bpy.types.Object, aspect: tuple[int, int], kind: str):
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
    camera.data.type = kind
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
    scene.render.resolution_x = 101  # half of it is 50.5: every engine drops the half pixel
    assert (run().camera.width, run().camera.height) == (50, 30)


def directions(camera: Camera) -> np.ndarray:
    """Directions (H, W, 3) of the middles of pixels, top row first."""
    left, right, bottom, top = camera.window
    x = left + (np.arange(camera.width) + 0.5) / camera.width * (right - left)
    y = top + (np.arange(camera.height) + 0.5)[:, None] / camera.height * (bottom - top)
    if camera.kind == "panorama":
        local = np.stack(np.broadcast_arrays(np.sin(x) * np.cos(y), np.sin(y), -np.cos(x) * np.cos(y)), axis=2)
    else:
        local = np.stack(np.broadcast_arrays(x, y, -1.0), axis=2)
        local /= np.linalg.norm(local, axis=2, keepdims=True)
    return local @ np.array(camera.to_world)[:3, :3].T


def cycles_directions(scene: bpy.types.Scene, path: Path) -> np.ndarray:
    """The directions (H, W, 3) in Cycles, from the image of a world whose colour is the direction."""
    tree = scene.world.node_tree
    coordinate, shifted = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeVectorMath")
    shifted.inputs[1].default_value = (SHIFT,) * 3
    tree.links.new(coordinate.outputs["Generated"], shifted.inputs[0])
    tree.links.new(shifted.outputs["Vector"], tree.nodes["Background"].inputs["Color"])
    cycles, render = scene.cycles, scene.render
    scene.world.cycles.sampling_method = "NONE"
    cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling, cycles.pixel_filter_type = 64, False, False, "BOX"
    render.engine, render.filepath = "CYCLES", str(path / "directions.exr")
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath)
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(*image.size[::-1], image.channels)[::-1, :, :3] - SHIFT


@pytest.mark.parametrize("region", [None, (0.1, 0.62, 0.3, 0.9)])
@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        ("PERSP", {"lens": 20.0, "shift_x": 0.2, "shift_y": -0.1}),
        ("PANO", {}),
        ("PANO", {"longitude_min": -1.0, "longitude_max": 2.0, "latitude_min": -0.3, "latitude_max": 1.2, "shift_x": 0.1, "shift_y": -0.2}),
    ],
)
def test_every_pixel_looks_where_it_does_in_cycles(
    run: Export, scene: bpy.types.Scene, camera: bpy.types.Object, tmp_path: Path, kind: str, settings: dict, region: tuple | None
):
    camera.location = (1000, 0, 0)  # only the world is in view
    camera.data.type, camera.data.panorama_type = kind, "EQUIRECTANGULAR"
    for name, value in settings.items():
        setattr(camera.data, name, value)
    render = scene.render
    render.resolution_x, render.resolution_y = 32, 18
    if region:
        render.use_border = render.use_crop_to_border = True
        render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = region
    exported = run()
    assert exported.coverage == ()
    assert directions(exported.camera) == pytest.approx(cycles_directions(scene, tmp_path), abs=0.02)  # at most a tenth of a pixel


def test_regions_are_whole_pixels_as_in_blender(run: Export, scene: bpy.types.Scene, camera: bpy.types.Object):
    render = scene.render
    render.resolution_x, render.resolution_y, render.use_border, render.use_crop_to_border = 10, 10, True, True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.3, 0.7, 0.19, 0.9
    whole = 0.5 * 36 / 50  # half the window
    exported = run().camera
    assert (exported.width, exported.height) == (4, 8)
    assert exported.window == pytest.approx(np.array((-0.4, 0.4, -0.8, 0.8)) * whole, abs=1e-6)


def test_a_region_in_a_frame_is_listed(run: Export, scene: bpy.types.Scene, camera: bpy.types.Object):
    scene.render.use_border, scene.render.border_max_x = True, 0.5
    exported = run()
    assert exported.camera.width == 8
    assert [loss.detail for loss in exported.coverage] == ["render region: the image is cropped to it, instead of black around it"]


def test_clip_distances(run: Export, camera: bpy.types.Object):
    camera.data.clip_start, camera.data.clip_end = 0.25, 750
    assert (run().camera.near, run().camera.far) == (0.25, 750)


def test_everything_is_in_focus_unless_asked_for(run: Export, camera: bpy.types.Object):
    camera.data.dof.aperture_fstop = 1.4
    assert run().camera.aperture == 0


@pytest.mark.parametrize(("kind", "aperture"), [("PERSP", 0.025), ("ORTHO", 0.5), ("PANO", 0.025)])
def test_depth_of_field(run: Export, camera: bpy.types.Object, kind: str, aperture: float):
    dof = camera.data.dof
    camera.data.type, camera.data.panorama_type, dof.use_dof = kind, "EQUIRECTANGULAR", True
    dof.aperture_fstop, dof.focus_distance, dof.aperture_blades, dof.aperture_rotation, dof.aperture_ratio = 1, 3, 6, 0.5, 2
    exported = run().camera
    assert (exported.aperture, exported.focus) == (pytest.approx(aperture), 3)
    assert (exported.blades, exported.blade_rotation, exported.aperture_ratio) == (6, 0.5, 2)
    dof.aperture_blades = 2
    assert run().camera.blades == 0


def test_the_focus_object_counts_along_the_view(run: Export, scene: bpy.types.Scene, camera: bpy.types.Object):
    camera.rotation_euler, camera.location = (math.pi / 2, 0, 0), (0, 1, 0)  # the camera looks along y
    camera.data.dof.use_dof, camera.data.dof.focus_object = True, bpy.data.objects["Cube"]
    bpy.data.objects["Cube"].location = (3, 5, 7)
    assert run().camera.focus == pytest.approx(4)


def test_a_focus_bone(run: Export, scene: bpy.types.Scene, camera: bpy.types.Object):
    camera.rotation_euler, camera.location = (math.pi / 2, 0, 0), (0, 0, 0)
    bpy.ops.object.armature_add(location=(0, 5, 0))
    bpy.context.object.pose.bones["Bone"].location.z = -2  # the bone stands upright: its z axis is -y
    camera.data.dof.use_dof, camera.data.dof.focus_object, camera.data.dof.focus_subtarget = True, bpy.context.object, "Bone"
    assert run().camera.focus == pytest.approx(7)


@pytest.mark.parametrize(("kind", "filter_width"), [("BOX", 1.0), ("GAUSSIAN", 2.5), ("BLACKMAN_HARRIS", 2.5)])
def test_film(run: Export, scene: bpy.types.Scene, camera: bpy.types.Object, kind: str, filter_width: float):
    scene.cycles.pixel_filter_type, scene.cycles.filter_width, scene.cycles.film_exposure = kind, 2.5, 2
    scene.render.film_transparent = True
    exported = run()
    assert exported.film == Film(kind.lower(), filter_width, 2, True)
    assert exported.coverage == ()


def test_bounces_are_scattering_events(run: Export, scene: bpy.types.Scene, camera: bpy.types.Object):
    cycles = scene.cycles
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces, cycles.transmission_bounces = 7, 1, 2, 3
    cycles.transparent_max_bounces, cycles.min_light_bounces = 5, 4
    assert run().bounces == Bounces(total=8, diffuse=2, glossy=3, transmission=4, transparent=5, roulette=6)
