"""The flags of `rlg` that choose frame, camera, scene or size of a .blend. A wrong value gives a line with the file's choices."""

from dataclasses import astuple
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon import commands
from addon.capture import exported
from addon.views import opened, source_key
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.bundle import load
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.view import AUTO, View


@pytest.fixture
def blend(scene: bpy.types.Scene, tmp_path: Path) -> Path:
    """A file saved at frame 2. A cube rises from frame 1 to 5. Camera A is at x = 1; from frame 3 on, camera B at x = 2 is active.

    Another scene has only camera B.
    """
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    for frame, height in ((1, 0), (5, 4)):
        cube.location.z = height
        cube.keyframe_insert("location", frame=frame)
    bpy.data.objects.remove(scene.camera)
    for k, name in enumerate("AB", start=1):
        camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
        scene.collection.objects.link(camera)
        camera.location = k, -9, 0
        scene.timeline_markers.new(name, frame=2 * k - 1).camera = camera
    other = bpy.data.scenes.new("Other")
    other.camera = bpy.data.objects["B"]
    for thing in (cube, other.camera):
        other.collection.objects.link(thing)
    other.render.resolution_x = other.render.resolution_y = 8
    other.world = scene.world
    scene.frame_set(2)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "two.blend"))
    return tmp_path / "two.blend"


def seen(blend: Path, view: View) -> SceneData:
    return exported(opened(blend, view), view)


@pytest.mark.parametrize(
    ("view", "x", "size", "frame"),
    [
        (View(), 1, (16, 16), 2),
        (View(frame=1), 1, (16, 16), 1),
        (View(frame=3), 2, (16, 16), 3),
        (View(frame=900), 2, (16, 16), 5),
        (View(frame=4, camera="A"), 1, (16, 16), 4),
        (View(scene="Other", frame=1), 2, (8, 8), 1),
        (View(resolution=(30, 20)), 1, (30, 20), 2),
        (View(percentage=50), 1, (8, 8), 2),
        (View(resolution=(30, 20), percentage=200), 1, (60, 40), 2),
    ],
)
def test_what_is_chosen_is_exported(blend: Path, view: View, x: float, size: tuple[int, int], frame: int):
    data = seen(blend, view)
    assert (data.camera.to_world[0][3], data.camera.width, data.camera.height) == (x, *size)
    height = exported(opened(blend, View(frame=frame)), View()).vertices[:, 2].max()
    assert data.vertices[:, 2].max() == height
    assert (data.name, View.from_json(view.to_json())) == ("two", view)


def test_the_resolution_is_whole_whatever_the_file_says(blend: Path):
    scene = opened(blend, View())
    scene.render.resolution_percentage = 25
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    assert seen(blend, View()).camera.width == 4
    assert seen(blend, View(resolution=(30, 20))).camera.width == 30


def test_a_file_without_a_camera_can_be_framed(blend: Path):
    scene = opened(blend, View())
    scene.render.use_border, scene.render.border_max_x = True, 0.5
    for marker in scene.timeline_markers:
        marker.camera = None
    scene.camera = None
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    with pytest.raises(
        InputError, match=r"^two\.blend: scene 'Scene' has no camera: --camera auto .*, --camera NAME takes one of 'A', 'B'$"
    ):
        opened(blend, View())
    data = seen(blend, View(camera=AUTO, resolution=(30, 20)))
    assert (data.camera.width, data.camera.height) == (30, 20)
    np.testing.assert_allclose(data.camera.window, (-0.36, 0.36, -0.24, 0.24), rtol=1e-6)
    assert np.linalg.norm(np.array(data.camera.to_world)[:3, 3] - data.vertices.mean(axis=0)) > 3


def test_simplify_culls_nothing_of_what_is_to_be_framed(blend: Path):
    """Culling needs the place of a camera, but the export makes this camera only later."""
    scene = opened(blend, View())
    cube = next(thing for thing in scene.objects if thing.type == "MESH")
    cube.animation_data_clear()
    cube.location.x = 30
    scene.render.use_simplify = scene.cycles.use_camera_cull = cube.cycles.use_camera_cull = True
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    assert len(seen(blend, View(camera=AUTO)).triangles) == 12


@pytest.mark.parametrize(
    ("view", "line"),
    [
        (View(scene="No"), r"^two\.blend has no scene 'No', but 'Other', 'Scene'$"),
        (View(camera="C"), r"^two\.blend: scene 'Scene' has no camera 'C', but 'A', 'B'; or --camera auto$"),
        (View(camera="A", scene="Other"), r"scene 'Other' has no camera 'A', but 'B'; or"),
    ],
)
def test_what_is_not_there_is_named(blend: Path, view: View, line: str):
    with pytest.raises(InputError, match=line):
        opened(blend, view)


def test_frames_are_known_by_the_file_what_it_refers_to_and_the_view(blend: Path, tmp_path: Path):
    (tmp_path / "sound.wav").write_bytes(b"RIFF")
    opened(blend, View())
    before = source_key(blend, View())
    assert source_key(blend, View()) == before
    assert source_key(blend, View(camera="A")) != before
    bpy.data.images.new("image", 1, 1).filepath = str(tmp_path / "image.png")
    bpy.data.images["image"].source = "FILE"
    missing = source_key(blend, View())
    (tmp_path / "image.png").write_bytes(b"now it is there")
    assert len({before, missing, source_key(blend, View())}) == 3
    with blend.open("ab") as file:
        file.write(b"\0")
    assert source_key(blend, View()) not in {before, missing}


@pytest.mark.parametrize(
    ("source", "name", "other"), [("TILED", "a[1].<UDIM>.png", "a[1].1002.png"), ("SEQUENCE", "b7 08.png", "b7 37.png")]
)
def test_frames_are_known_by_all_tiles_and_files_of_a_sequence(blend: Path, tmp_path: Path, source: str, name: str, other: str):
    opened(blend, View())
    image = bpy.data.images.new("image", 1, 1)
    image.source, image.filepath = source, str(tmp_path / name)
    before = source_key(blend, View())
    (tmp_path / other).write_bytes(b"painted")
    assert source_key(blend, View()) != before


def test_the_command_in_blender_takes_the_same_flags(blend: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    bundle = tmp_path / "other.npz"
    flags = ["--scene", "Other", "--camera", "auto", "--resolution", "12x10", "--percentage", "50", "--frame", "5"]
    assert commands.main(["export", str(blend), str(bundle), *flags]) == 0
    expected = seen(blend, View(5, AUTO, "Other", (12, 10), 50))
    assert load(bundle).key == expected.key
    assert (expected.camera.width, expected.camera.height) == (6, 5)
    capsys.readouterr()
    assert commands.main(["render", str(blend), "--out", str(tmp_path / "out"), "--camera", "C"]) == 2
    assert "has no camera 'C'" in capsys.readouterr().err
    assert astuple(View()) == (None,) * 5
