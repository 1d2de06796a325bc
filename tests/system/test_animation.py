"""An animation is rendered into numbered files. After an interrupt at any moment, it goes on with the same bits."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from blender_rl_guiding.images import read_exr
from tests.patience import PATIENCE
from tests.system.small import SMALL

ROOT = Path(__file__).resolve().parents[2]

# A sun over a cube that moves; the camera changes at frame 12.
BUILD = """
import bpy, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
bpy.ops.mesh.primitive_cube_add()
for frame in (10, 14):
    bpy.context.object.location.z = frame / 4 - 3
    bpy.context.object.keyframe_insert("location", frame=frame)
for k, name in enumerate("AB"):
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler = (k, -9, 0), (1.5708, 0, 0)
    scene.timeline_markers.new(name, frame=10 + 2 * k).camera = camera
sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
scene.collection.objects.link(sun)
sun.rotation_euler = 0.7, 0.3, 0
scene.render.resolution_x = scene.render.resolution_y = 12
scene.frame_set(10)
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
"""

# A program that runs `rlg` and kills it while `rlg` writes its second frame.
KILLED = """
import os, signal, sys
from blender_rl_guiding.doors import cli
from blender_rl_guiding.experiments import runs
real, calls = runs.write_png, []
def write_png(path, image):
    calls.append(path)
    if len(calls) == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    real(path, image)
runs.write_png = write_png
sys.exit(cli.main())
"""


@pytest.fixture(scope="module")
def blend(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("moving") / "moving.blend"
    subprocess.run([sys.executable, "-c", BUILD, str(path)], check=True, capture_output=True)
    return path


def images(folder: Path) -> dict[str, np.ndarray]:
    return {path.name: read_exr(path)[0] for path in sorted(folder.glob("*.exr"))}


def written(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in folder.iterdir()}


def test_a_killed_animation_goes_on(rlg, blend, tmp_path):
    command = ["render", blend, "--frames", "10..14..2", "--guide", "dqn", "--spp", 3, "--nee", *SMALL]
    done = rlg(*command, "--out", tmp_path / "whole")
    whole = images(tmp_path / "whole")
    assert done.stdout.splitlines() == [str(tmp_path / "whole" / name) for name in whole]
    assert list(whole) == ["image-0010.exr", "image-0012.exr", "image-0014.exr"]
    assert set(written(tmp_path / "whole")) == {f"{kind}-00{n}.{end}" for kind, end in ENDS for n in (10, 12, 14)}
    assert len({image.tobytes() for image in whole.values()}) == 3

    cut = tmp_path / "cut"
    killed = subprocess.run(
        [sys.executable, "-c", KILLED, *map(str, command), "--out", str(cut)], cwd=ROOT, capture_output=True, timeout=PATIENCE
    )
    assert killed.returncode == -9, killed.stderr
    assert "result-0010.json" in written(cut)
    assert "result-0012.json" not in written(cut)
    before = written(cut)
    again = rlg(*command, "--out", cut)
    assert again.stderr.splitlines()[0] == "1 of 3 frames are done"
    for name, image in images(cut).items():
        np.testing.assert_array_equal(image, whole[name], err_msg=name)
    kept = [name for name in before if "-0010." in name]
    assert len(kept) == len(ENDS)
    assert {name: written(cut)[name] for name in kept} == {name: before[name] for name in kept}

    everything = written(cut)
    nothing = rlg(*command, "--out", cut)
    assert (nothing.returncode, nothing.stderr.splitlines()) == (0, ["3 of 3 frames are done"])
    assert nothing.stdout.splitlines() == [str(cut / name) for name in whole]
    assert written(cut) == everything

    changed = rlg(*command[:2], "--frames", "10..10", "--spp", 1, "--out", cut)
    assert changed.stderr.splitlines()[0].startswith("1 frame(s) were made with other settings or of another state of the file")
    assert json.loads((cut / "result-0010.json").read_text())["spp"] == 1
    assert images(cut)["image-0012.exr"].tobytes() == whole["image-0012.exr"].tobytes()


ENDS = [("image", "exr"), ("image", "png"), ("result", "json")]


def test_the_frames_are_those_of_single_renders(rlg, blend, tmp_path):
    flags = ["--spp", 2, "--nee", "--out"]
    assert rlg("render", blend, "--frames", "12..13", "--camera", "B", *flags, tmp_path / "all").returncode == 0
    assert rlg("render", blend, "--frame", 13, *flags, tmp_path / "one").returncode == 0  # a timeline marker has chosen camera B
    single = read_exr(tmp_path / "one" / "image.exr")[0]
    assert images(tmp_path / "all")["image-0013.exr"].tobytes() == single.tobytes()


def test_what_cannot_be_rendered_is_a_line(rlg, blend, tmp_path):
    done = rlg("render", blend, "--frames", "1..2", "--camera", "C", "--out", tmp_path / "out")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "rlg: moving.blend: scene 'Scene' has no camera 'C', but 'A', 'B'; or --camera auto\n"
    assert not (tmp_path / "out").exists()
