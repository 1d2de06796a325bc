"""A child process exports a .blend as a bundle, by the bpy module or a Blender executable. Each error is one line."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.opening import blend
from blender_rl_guiding.scene.bundle import load
from blender_rl_guiding.scene.description import Closure, Loss
from tests.blender.blenders import EXECUTABLE, ROOT
from tests.patience import PATIENCE

C1 = ROOT / "scenes" / "c1.blend"

needs_executable = pytest.mark.skipif(not EXECUTABLE.is_file(), reason=f"no Blender at {EXECUTABLE}; the variable BLENDER names one")

BUILD = """
import bpy, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_plane_add()
scene = bpy.context.scene
scene.collection.objects.link(bpy.data.objects.new("Fog", bpy.data.volumes.new("Fog")))
scene.world = bpy.data.worlds.new("World")
text = bpy.data.texts.new("autorun.py")
text.use_module = True
text.write(f"open({sys.argv[1] + '/ran'!r}, 'w')")
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1] + "/no camera.blend")
bpy.ops.object.camera_add()
scene.camera = bpy.context.object
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1] + "/fog.blend")
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with fog.blend: a plane, a volume and a script. And the same file without a camera."""
    folder = tmp_path_factory.mktemp("files")
    subprocess.run([sys.executable, "-c", BUILD, str(folder)], check=True, capture_output=True)
    return folder


@pytest.fixture(scope="module")
def c1(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bundle of c1, in a folder that the export has made."""
    bundle = tmp_path_factory.mktemp("c1") / "new" / "c1.npz"
    assert blend.export(C1, bundle) == ()
    return bundle


def script(path: Path, text: str) -> Path:
    """A stand-in for the Blender executable."""
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


def test_c1_is_exported_whole(c1: Path):
    scene = load(c1)
    assert (scene.name, scene.bounces.total, scene.world.closures) == ("c1", 10, ())
    assert (scene.camera.width, scene.camera.height) == (250, 250)
    assert len(scene.triangles) == 3 * 128 * 126 + 8 * 2
    assert [c for s in scene.shaders for c in s.closures if c.kind == "emission"] == [
        Closure("emission", 1.0, {"color": (1.0, 1.0, 1.0), "strength": 8.0})
    ]
    assert scene.coverage == ()
    assert [p.name for p in c1.parent.iterdir()] == ["c1.npz"]


@needs_executable
@pytest.mark.blender
def test_module_and_executable_give_the_same_scene(c1: Path, tmp_path: Path):
    blend.export(C1, tmp_path / "c1.npz", blender=EXECUTABLE)
    assert load(tmp_path / "c1.npz").key == load(c1).key


@needs_executable
@pytest.mark.blender
def test_the_executable_reports_coverage_and_damage(tmp_path: Path, files: Path):
    losses = blend.export(files / "fog.blend", tmp_path / "foggy.npz", blender=EXECUTABLE)
    assert [loss.object for loss in losses] == ["Fog"]
    damaged = tmp_path / "damaged.blend"
    damaged.write_bytes(C1.read_bytes()[:100_000])
    with pytest.raises(InputError, match=r"cannot open .*damaged\.blend, it may be damaged: "):
        blend.export(damaged, tmp_path / "damaged.npz", blender=EXECUTABLE)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["damaged.blend", "foggy.npz"]


def test_coverage_is_returned_and_kept_in_the_bundle(tmp_path: Path, files: Path):
    expected = (Loss("Fog", "", "volume is left out"),)
    assert blend.export(files / "fog.blend", tmp_path / "foggy.npz") == expected
    assert load(tmp_path / "foggy.npz").coverage == expected
    assert not (files / "ran").exists(), "a script inside the .blend was run"


def test_strict_refuses_and_leaves_the_old_bundle(tmp_path: Path, files: Path):
    bundle = tmp_path / "foggy.npz"
    bundle.write_bytes(b"old")
    with pytest.raises(InputError, match=r"^fog\.blend: 1 thing\(s\) cannot be exported, the first: 'Fog': volume is left out"):
        blend.export(files / "fog.blend", bundle, strict=True)
    assert [p.read_bytes() for p in tmp_path.iterdir()] == [b"old"]


def test_no_camera(tmp_path: Path, files: Path):
    with pytest.raises(InputError, match=r"^no camera\.blend: scene 'Scene' has no camera"):
        blend.export(files / "no camera.blend", tmp_path / "dark.npz")


def test_open_scene_takes_both_kinds(c1: Path):
    assert blend.open_scene(C1).key == blend.open_scene(c1).key


def test_a_truncated_file(tmp_path: Path):
    damaged = tmp_path / "damaged.blend"
    damaged.write_bytes(C1.read_bytes()[:250_000])
    with pytest.raises(InputError, match=r"^Blender cannot open .*damaged\.blend, it may be damaged: .*$"):
        blend.export(damaged, tmp_path / "damaged.npz")
    assert [p.name for p in tmp_path.iterdir()] == ["damaged.blend"]


def test_what_is_not_a_blend_file(tmp_path: Path):
    with pytest.raises(InputError, match=r"^cannot read .*missing\.blend: No such file or directory$"):
        blend.export(tmp_path / "missing.blend", tmp_path / "out.npz")
    (tmp_path / "text.blend").write_text("not a scene")
    with pytest.raises(InputError, match=r"text\.blend is not a \.blend file$"):
        blend.export(tmp_path / "text.blend", tmp_path / "out.npz")
    with pytest.raises(InputError, match=r"^cannot read .*: Is a directory$"):
        blend.export(tmp_path, tmp_path / "out.npz")


def test_a_missing_bpy_says_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(blend.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"bpy module is not installed \(\./build\.sh setup"):
        blend.export(C1, tmp_path / "out.npz")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("echo boom >&2; exit 3", "it ended with status 3: boom$"),
        ("kill -SEGV $$", "it was ended by SIGSEGV: it gave no reason$"),
        ("kill -KILL $$", r"it was ended by SIGKILL: too little memory\?$"),
        ("true", "it ended with status 0: it gave no reason$"),
        ("""echo '{"error": "object X: bad"}'; exit 1""", "^object X: bad$"),
    ],
)
def test_a_blender_that_fails(tmp_path: Path, text: str, message: str):
    with pytest.raises(InputError, match=message):
        blend.export(C1, tmp_path / "out" / "c1.npz", blender=script(tmp_path / "blender", text))
    assert list((tmp_path / "out").iterdir()) == []


def test_a_blender_that_is_not_there(tmp_path: Path):
    with pytest.raises(InputError, match=r"^cannot run /nowhere/blender: No such file or directory$"):
        blend.export(C1, tmp_path / "c1.npz", blender=Path("/nowhere/blender"))


def test_a_place_that_cannot_be_written(tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"^cannot write .*c1\.npz: (Not a directory|File exists)$"):
        blend.export(C1, tmp_path / "file" / "c1.npz")
    blender = script(tmp_path / "blender", """touch "$9"; echo '{"ok": "", "coverage": []}'""")
    (tmp_path / "c1.npz").mkdir()
    with pytest.raises(InputError, match=r"^cannot write .*c1\.npz: Is a directory$"):
        blend.export(C1, tmp_path / "c1.npz", blender=blender)


def test_interruption_ends_the_child_and_leaves_nothing(tmp_path: Path):
    program = """
import signal, sys
from pathlib import Path
from blender_rl_guiding.opening import blend
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell makes background jobs ignore SIGINT
def told(child, path):
    print(child.process.pid, flush=True)
    return real(child, path)
real, blend._coverage = blend._coverage, told
scene, bundle, blender = map(Path, sys.argv[1:])
blend.export(scene, bundle, blender=blender)
"""
    command = [sys.executable, "-c", program, C1, tmp_path / "out" / "c1.npz", script(tmp_path / "blender", "exec sleep 3600")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as parent:
        assert parent.stdout
        child = int(parent.stdout.readline())
        parent.send_signal(signal.SIGINT)
        assert parent.wait(timeout=PATIENCE) != 0
    assert list((tmp_path / "out").iterdir()) == []
    with pytest.raises(ProcessLookupError):
        os.kill(child, 0)


def test_whoever_does_not_wait_for_a_scene_leaves_no_child(tmp_path: Path):
    with blend.opening(C1, script(tmp_path / "blender", f"echo $$ > {tmp_path}/pid; exec sleep 3600")):
        while not (tmp_path / "pid").exists() or not (tmp_path / "pid").read_text():
            time.sleep(0.02)
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)
