"""The automatic camera: all important objects are in the picture, and walls and skies do not hide them."""

from dataclasses import replace

import numpy as np
import pytest

from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import CAMERA, VISIBLE, Camera
from blender_rl_guiding.scene.framing import OUTSIDE, framed
from tests import scenes
from tests.scenes import Builder, Vector, material

GREY, LIGHT = material("grey", (0.5,) * 3), material("light", emission=(1.0,) * 3)
CUBE = ("-x", "+x", "-y", "+y", "-z", "+z")


def scene_of(*boxes: tuple[Vector, Vector], shader=GREY, aspect: float = 1.5) -> SceneData:
    """A scene in which each box is an object. A box without depth is a quadrilateral."""
    builder, owners = Builder(), []
    for number, (low, high) in enumerate(boxes):
        flat = low[2] == high[2]
        scenes.box(builder, low, high, dict.fromkeys(("-z",) if flat else CUBE, shader))
        owners += [number] * (2 if flat else 12)
    found = builder.scene(Camera(np.eye(4).tolist(), (-0.36, 0.36, -0.36 / aspect, 0.36 / aspect), 30, 20))
    return replace(found, object=np.array(owners, np.int32), visibility=np.full(len(boxes), VISIBLE, np.uint8))


def seen(camera: Camera, points) -> tuple[np.ndarray, np.ndarray]:
    """For points (n, 3): places in the picture (n, 2), within 0..1 if visible, and depths (n,)."""
    matrix = np.array(camera.to_world)
    local = (np.atleast_2d(points) - matrix[:3, 3]) @ matrix[:3, :3]
    left, right, bottom, top = camera.window
    plane = local[:, :2] / -local[:, 2:]
    return (plane - (left, bottom)) / (right - left, top - bottom), -local[:, 2]


def place(camera: Camera) -> np.ndarray:
    return np.array(camera.to_world)[:3, 3]


@pytest.mark.parametrize("aspect", [0.4, 1.0, 3.0])
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_everything_is_in_the_picture_and_fills_it(aspect: float, size: float):
    rng = np.random.default_rng(1)
    lows = rng.uniform(-3, 3, (9, 3)) + np.array((5, -7, 40))
    scene = scene_of(*((tuple(size * low), tuple(size * (low + 1))) for low in lows), aspect=aspect)
    camera = framed(scene)
    where, depth = seen(camera, scene.vertices)
    assert ((where >= 0) & (where <= 1)).all()
    assert (np.ptp(where, axis=0) > 0.6).any()
    assert ((depth > camera.near) & (depth < camera.far)).all()
    rotation = np.array(camera.to_world)[:3, :3]
    np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(rotation[:, 2], OUTSIDE)
    assert rotation[2, 0] == 0
    assert rotation[2, 1] > 0


THING = ((-1.0, -1.0, 0.0), (1.0, 1.0, 2.0))
GROUND = ((-50.0, -50.0, 0.0), (50.0, 50.0, 0.0))
SKY = ((-60.0, -60.0, -60.0), (60.0, 60.0, 60.0))
TABLE = ((-2.0, -2.0, -0.1), (2.0, 2.0, 0.0))


@pytest.mark.parametrize("around", [[GROUND], [SKY], [SKY, GROUND]])
def test_grounds_and_skies_do_not_count_and_hide_nothing(around):
    camera, plain = framed(scene_of(THING, *around)), framed(scene_of(THING))
    np.testing.assert_allclose(place(camera), place(plain))
    depth = seen(camera, scene_of(THING).vertices)[1]
    assert camera.near < depth.min()
    assert camera.far > 100
    if SKY in around:
        assert camera.near > 0.5 * depth.min()


def test_what_a_thing_stands_on_counts():
    assert (seen(framed(scene_of(THING, TABLE)), scene_of(TABLE).vertices)[0] > 0).all()


def test_in_a_room_the_camera_stands_inside():
    room = ((-3.0, -2.0, 0.0), (4.0, 5.0, 3.0))
    things = [((x, y, 0.0), (x + 0.5, y + 0.5, 0.6)) for x, y in ((-2, 0), (2, 1), (0, 3.5))]
    camera = framed(scene_of(room, *things))
    assert ((np.array(room[0]) < place(camera)) & (place(camera) < room[1])).all()
    assert camera.near < 0.1
    assert camera.window[1] > 0.5


def test_a_closed_thing_alone_is_seen_from_outside():
    assert np.linalg.norm(place(framed(scene_of(THING))) - (0, 0, 1)) > 3


def test_lights_and_what_the_camera_does_not_see_do_not_count():
    lamp = scene_of(((90.0, 0.0, 9.0), (92.0, 2.0, 10.0)), THING)
    expected = place(framed(scene_of(THING)))
    lit = replace(lamp, shaders=(LIGHT, GREY), material=np.repeat(np.int32([0, 1]), 12))
    np.testing.assert_allclose(place(framed(lit)), expected)
    np.testing.assert_allclose(place(framed(replace(lamp, visibility=np.uint8([VISIBLE - CAMERA, VISIBLE])))), expected)
    assert np.linalg.norm(place(framed(lamp)) - expected) > 50
    assert np.linalg.norm(place(framed(scene_of(THING, shader=LIGHT))) - expected) < 1e-9


def test_an_empty_scene_has_a_camera():
    empty = scene_of(THING)
    arrays = {name: getattr(empty, name)[:0] for name in ("vertices", "triangles", "normals", "material", "object", "visibility")}
    assert np.isfinite(place(framed(replace(empty, **arrays)))).all()
