"""The zip of `./build.sh extension`: its contents, and its life in each Blender from installation to removal."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import numpy as np
import pytest

from blender_rl_guiding import __version__
from blender_rl_guiding.doors.cli import main as rlg
from blender_rl_guiding.images import read_exr
from tests.blender import blenders
from tests.blender.blenders import ROOT
from tests.patience import PATIENCE

SCRIPT = Path(__file__).with_name("life_cycle.py")
NEWER = "0.2.0"


def pack(tree: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Make the zip of a source tree, as `./build.sh extension` does."""
    command = [sys.executable, "-m", "scripts.extension", blenders.uv(), str(folder)]
    return subprocess.run(command, cwd=tree, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The zip of this tree."""
    folder = tmp_path_factory.mktemp("zip")
    done = pack(ROOT, folder)
    assert done.returncode == 0, done.stderr
    assert [path.name for path in folder.iterdir()] == [f"rl_guided-{__version__}.zip"]
    return folder / f"rl_guided-{__version__}.zip"


@pytest.fixture(scope="module")
def other_tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the zip's sources, one release later."""
    tree = tmp_path_factory.mktemp("tree")
    for name in ("addon", "blender_rl_guiding", "scripts"):
        shutil.copytree(ROOT / name, tree / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("LICENSE", "pyproject.toml"):
        shutil.copy(ROOT / name, tree)
    for path in (tree / "pyproject.toml", tree / "blender_rl_guiding" / "__init__.py"):
        path.write_text(path.read_text().replace(f'"{__version__}"', f'"{NEWER}"'))
    return tree


@pytest.fixture(scope="module")
def newer(other_tree: Path) -> Path:
    """The zip of the next release."""
    done = pack(other_tree, other_tree / "out")
    assert done.returncode == 0, done.stderr
    return other_tree / "out" / f"rl_guided-{NEWER}.zip"


def opened(archive: Path) -> tuple[dict, list[str], list[str]]:
    """(manifest, files of the add-on, files of the wheel)."""
    with zipfile.ZipFile(archive) as outer:
        manifest = tomllib.loads(outer.read("blender_manifest.toml").decode())
        (path,) = manifest["wheels"]
        with outer.open(path.removeprefix("./")) as file, zipfile.ZipFile(file) as wheel:
            return manifest, outer.namelist(), [name for name in wheel.namelist() if not name.endswith("/")]


def test_one_version_throughout(archive: Path, newer: Path):
    for path, version in ((archive, __version__), (newer, NEWER)):
        manifest, _, wheel = opened(path)
        assert manifest["version"] == version
        assert manifest["wheels"][0].startswith(f"./wheels/blender_rl_guiding-{version}+")
        assert {name.split("/")[0].partition("+")[0] for name in wheel} == {"blender_rl_guiding", f"blender_rl_guiding-{version}"}
    assert tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"] == __version__


def test_versions_that_disagree_are_refused(other_tree: Path, tmp_path: Path):
    tree = tmp_path / "tree"
    shutil.copytree(other_tree, tree)
    shutil.copy(ROOT / "pyproject.toml", tree)
    done = pack(tree, tmp_path / "out")
    assert (done.returncode, done.stderr) == (1, f"extension: pyproject.toml does not have the package's version {NEWER}\n")
    assert not list((tmp_path / "out").iterdir())


def test_nothing_but_our_own_code(archive: Path):
    manifest, files, wheel = opened(archive)
    assert manifest["wheels"][0].endswith("-py3-none-any.whl")
    assert "platforms" not in manifest
    own = {path.relative_to(ROOT).as_posix() for path in (ROOT / "blender_rl_guiding").rglob("*") if path.is_file()}
    assert {name for name in wheel if ".dist-info/" not in name} == {name for name in own if "__pycache__" not in name}
    assert all(name.endswith(".py") or name in {"LICENSE", "blender_manifest.toml", manifest["wheels"][0][2:]} for name in files)
    assert not [name for name in files + wheel if "test" in name]
    assert "headless.py" not in files


def test_same_sources_same_bytes(newer: Path, other_tree: Path, tmp_path: Path):
    for path in other_tree.rglob("*.py"):
        os.utime(path, (1_000_000_000, 1_000_000_000))
    assert pack(other_tree, tmp_path).returncode == 0
    assert (tmp_path / newer.name).read_bytes() == newer.read_bytes()


@pytest.mark.blender
@pytest.mark.parametrize("blender", [blenders.module, blenders.executable, blenders.oldest], ids=lambda blender: blender.__name__)
def test_life_cycle(blender, archive: Path, newer: Path, tmp_path: Path, compiled: None):
    """From installation to removal, with and without an environment: render, compare, save, reload, append, undo, update."""
    command, variables = blender()
    home = tmp_path / "ein Ordner für 漢字"
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | variables
    environment |= {"BLENDER_USER_RESOURCES": str(home / "user"), "XDG_DATA_HOME": str(home / "data")}
    (home / "user").mkdir(parents=True)
    separator = ["--"] if "--background" in command else []
    for step, file in (("new", archive), ("again", newer)):
        done = subprocess.run(
            [*command, str(SCRIPT), *separator, step, str(file), str(home)],
            env=environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        said = done.stdout + done.stderr
        assert done.returncode == 0, f"{step}: {said}"
        assert "Traceback" not in said, f"{step}: {said}"


SMALL = "import bpy; s = bpy.context.scene; s.rl_guiding.spp = 2; s.rl_guiding.guide = 'qtable'; s.render.image_settings.color_depth = '32'"


@pytest.mark.blender
def test_renders_without_a_window(archive: Path, tmp_path: Path, compiled: None):
    """Two renders at once by `-E RL_GUIDED -f 1`, and one by `--command rl_guided`, have the bits of `rlg`."""
    blenders.executable()
    user, data, c1 = tmp_path / "user", tmp_path / "data", ROOT / "scenes" / "c1.blend"
    user.mkdir()
    pointer = data / "blender_rl_guiding" / "python"
    pointer.parent.mkdir(parents=True)
    pointer.write_text(sys.executable)
    environment = os.environ | {"BLENDER_USER_RESOURCES": str(user), "XDG_DATA_HOME": str(data)}

    def start(*arguments: str) -> subprocess.Popen[str]:
        command = [str(blenders.EXECUTABLE), *arguments]
        return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def end(child: subprocess.Popen[str]) -> None:
        said, _ = child.communicate(timeout=PATIENCE)
        assert child.returncode == 0, said
        assert "Error" not in said, said

    end(start("--command", "extension", "install-file", "--repo", "user_default", "--enable", str(archive)))
    frame = ["--background", str(c1), "--engine", "RL_GUIDED", "--render-format", "OPEN_EXR", "--python-expr", SMALL]
    for child in [start(*frame, "--render-output", str(tmp_path / f"{name}-#.exr"), "--render-frame", "1") for name in "ab"]:
        end(child)
    flags = ["--guide", "qtable", "--spp", "2", "--out"]
    end(start("--command", "rl_guided", "render", str(c1), *flags, str(tmp_path / "command")))
    assert rlg(["render", str(c1), *flags, str(tmp_path / "rlg")]) == 0
    expected, _ = read_exr(tmp_path / "rlg" / "image.exr")
    for path in ("a-1.exr", "b-1.exr", "command/image.exr"):
        np.testing.assert_array_equal(read_exr(tmp_path / path)[0], expected, err_msg=path)


@pytest.mark.slow
@pytest.mark.blender
def test_in_the_window(archive: Path, tmp_path: Path):
    """Install from disk and check by clicks in the Preferences. Screenshots stay in out/screens."""
    blenders.executable()
    screens = ROOT / "out" / "screens"
    screens.mkdir(parents=True, exist_ok=True)
    (tmp_path / "user").mkdir()
    environment = os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path / "user"), "XDG_DATA_HOME": str(tmp_path / "data")}
    script = Path(__file__).with_name("window_install.py")
    subprocess.run(
        [str(blenders.EXECUTABLE), "--python", str(script), "--", str(archive), str(tmp_path), str(screens), sys.executable],
        env=environment | {"SCREEN": "1600x1000x24"},
        capture_output=True,
        timeout=PATIENCE,
        check=False,
    )
    assert json.loads((tmp_path / "result.json").read_text()) == {}
