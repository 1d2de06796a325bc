"""If a process is killed, each Blender that this process started ends, even in the middle of its work."""

import os
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from blender_rl_guiding.leftovers import sweep
from tests.blender.blenders import EXECUTABLE, ROOT
from tests.patience import PATIENCE

BUILD = """
import bpy, random, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_plane_add()
bpy.ops.object.camera_add()
scene = bpy.context.scene
scene.camera = bpy.context.object
scene.world = bpy.data.worlds.new("World")
tree = scene.world.node_tree
sky = tree.nodes.new("ShaderNodeTexSky")
sky.sun_elevation = random.random()  # a sky that is in no cache
tree.links.new(sky.outputs[0], tree.nodes["Background"].inputs["Color"])
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
"""
EXPORT = """
import sys
from pathlib import Path
from blender_rl_guiding.opening.blend import export
export(Path(sys.argv[1]), Path(sys.argv[2], "out.npz"), blender=Path(sys.argv[3]) if sys.argv[3:] else None)
"""
FRAMES = """
import sys
from pathlib import Path
from blender_rl_guiding.opening.frames import exporting_frames
from blender_rl_guiding.scene.view import View
with exporting_frames(Path(sys.argv[1]), View()) as frames:
    frames.source()
    frames.ask(1)
    frames.take()
"""
IDLE = """
import sys
from pathlib import Path
from blender_rl_guiding.opening.frames import exporting_frames
from blender_rl_guiding.scene.view import View
with exporting_frames(Path(sys.argv[1]), View()) as frames:
    frames.source()
    Path(sys.argv[2], "now").touch()
    sys.stdin.read()
"""
REFERENCE = """
import sys
from pathlib import Path
import addon, bpy
from addon.comparison.steps import Cycles
addon.register()
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
bpy.context.scene.world.node_tree.links.clear()
for _ in Cycles(bpy.context.scene, 10_000_000).render(Path(sys.argv[2], "out.exr"), 1.0):
    Path(sys.argv[2], "now").touch()
"""

F12 = """
import sys
from pathlib import Path
import addon, bpy
from addon import engine, installation
addon.register()
installation.python = lambda: Path(sys.executable)
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
bpy.context.scene.world.node_tree.links.clear()
bpy.context.scene.render.engine = "RL_GUIDED"
bpy.context.scene.rl_guiding.spp = 1_000_000
real = engine.status_line
engine.status_line = lambda event: Path(sys.argv[2], "now").touch() or real(event)
bpy.ops.render.render()
"""

CHECK = """
import sys
from pathlib import Path
import addon, bpy
from addon import installation
installation.python = lambda: Path(sys.argv[1])
installation.check()
"""


def family(mark: str) -> dict[int, str]:
    """Process id -> command line, for processes with the mark among their environment variables. Children inherit the mark."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if mark.encode() in (folder / "environ").read_bytes():  # unreadable once a process has ended
                found[int(folder.name)] = (folder / "cmdline").read_bytes().decode()
        except OSError:
            continue
    return found


def wait_for(reached: Callable[[], object], what: str) -> None:
    deadline = time.monotonic() + PATIENCE
    while not reached():
        assert time.monotonic() < deadline, what
        time.sleep(0.02)


@pytest.fixture
def temporary(tmp_path: Path) -> Path:
    """The folder of the programs' temporary files."""
    (tmp_path / "tmp").mkdir()
    return tmp_path / "tmp"


@pytest.fixture
def killed(temporary: Path) -> Iterator[Callable[..., None]]:
    """Run a program, and kill it once it has a child with this command line (and is ready, if the caller asks for that).

    Then wait until all its processes have ended.
    """
    mark = f"RL_GUIDED_TEST={uuid.uuid4()}"
    name, value = mark.split("=")

    def run(program: str, *arguments: object, child: str, ready: Path | None = None) -> None:
        variables = os.environ | {name: value, "TMPDIR": str(temporary)}
        command = [sys.executable, "-c", program, *map(str, arguments)]
        with subprocess.Popen(command, cwd=ROOT, env=variables, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as parent:
            try:
                wait_for(lambda: parent.poll() is not None or any(child in line for line in family(mark).values()), f"no {child}")
                wait_for(lambda: parent.poll() is not None or ready is None or ready.exists(), f"no {ready}")
                assert parent.poll() is None, "it has ended by itself"
                assert len(family(mark)) > 1
            finally:
                parent.kill()
        wait_for(lambda: not family(mark), f"still there: {family(mark)}")

    yield run
    for process in family(mark):
        os.kill(process, signal.SIGKILL)


@pytest.fixture(scope="module")
def blend(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with a sky: its export starts another Blender."""
    path = tmp_path_factory.mktemp("orphans") / "sky.blend"
    subprocess.run([sys.executable, "-c", BUILD, str(path)], check=True, capture_output=True)
    return path


def test_an_export_that_has_just_begun(killed: Callable[..., None], blend: Path, tmp_path: Path):
    killed(EXPORT, blend, tmp_path, child="headless.py")
    assert not (tmp_path / "out.npz").exists()


@pytest.mark.parametrize("program", [EXPORT, FRAMES], ids=["still", "frames"])
def test_an_export_and_the_blender_that_it_waits_for(program: str, killed: Callable[..., None], blend: Path, tmp_path: Path):
    killed(program, blend, tmp_path, child="cycles_pictures.py")
    assert not (tmp_path / "out.npz").exists()


def test_an_exporter_that_waits_for_the_next_frame(killed: Callable[..., None], blend: Path, tmp_path: Path):
    killed(IDLE, blend, tmp_path, child="headless.py", ready=tmp_path / "now")


def test_the_reference_by_cycles(killed: Callable[..., None], blend: Path, tmp_path: Path):
    killed(REFERENCE, blend, tmp_path, child="cycles_reference.py", ready=tmp_path / "now")


def test_f12_and_the_next_start_sweeps_what_it_left(
    killed: Callable[..., None], blend: Path, temporary: Path, compiled: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    killed(F12, blend, tmp_path, child="blender_rl_guiding.doors.worker", ready=tmp_path / "now")
    (left,) = temporary.glob("rlg-*")
    assert (left / "scene.npz").exists()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    sweep(temporary)
    assert not left.exists()


def test_the_check_of_the_environment(killed: Callable[..., None], tmp_path: Path):
    (tmp_path / "python").write_text("#!/bin/sh\ncat\n")  # like `environment`, it ends when its stdin ends
    (tmp_path / "python").chmod(0o755)
    killed(CHECK, tmp_path / "python", child="blender_rl_guiding.environment")


@pytest.mark.skipif(not EXECUTABLE.is_file(), reason=f"no Blender at {EXECUTABLE}; the variable BLENDER names one")
@pytest.mark.blender
def test_a_blender_behind_a_script_that_starts_it(killed: Callable[..., None], blend: Path, tmp_path: Path):
    """Only the script is a child of the killed process."""
    killed(EXPORT, blend, tmp_path, EXECUTABLE, child="cycles_pictures.py")
