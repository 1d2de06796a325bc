"""The renderer's environment announces its place. It names each missing or wrong part, with the command that repairs it."""

import importlib
import json
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from blender_rl_guiding import __version__, environment
from blender_rl_guiding.environment import Part
from blender_rl_guiding.errors import InputError
from tests.patience import PATIENCE

ROOT = Path(__file__).resolve().parents[2]
BUILD = str(ROOT / "build.sh")


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A data folder that is not the user's."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    return tmp_path / "data"


def test_what_is_announced_is_found(data: Path):
    assert environment.find() is None
    environment.announce()
    assert environment.find() == Path(sys.executable)
    assert [path.name for path in (data / "blender_rl_guiding").iterdir()] == ["python"]


def test_an_empty_pointer_points_nowhere(data: Path):
    environment.pointer().parent.mkdir(parents=True)
    environment.pointer().write_text("\n")
    assert environment.find() is None


def test_a_pointer_that_cannot_be_used_is_named(data: Path):
    environment.pointer().parent.mkdir(parents=True)
    environment.pointer().write_bytes(b"\xff")
    with pytest.raises(InputError, match=r"^cannot read .*data/blender_rl_guiding/python: "):
        environment.find()
    environment.pointer().unlink()
    environment.pointer().mkdir()
    with pytest.raises(InputError, match=r"^cannot write .*data/blender_rl_guiding/python: Is a directory$"):
        environment.announce()


@pytest.mark.parametrize(
    ("platform", "folder"), [("linux", ".local/share"), ("darwin", "Library/Application Support"), ("win32", "AppData/Local")]
)
def test_every_platform_has_its_folder(monkeypatch: pytest.MonkeyPatch, platform: str, folder: str):
    monkeypatch.setattr(environment.Path, "home", lambda: Path("/home/me"))
    monkeypatch.setattr(sys, "platform", platform)
    for invalid in ("", "relative/path"):
        monkeypatch.setenv("XDG_DATA_HOME", invalid)
        assert environment.pointer() == Path("/home/me", folder, "blender_rl_guiding", "python")
    monkeypatch.setenv("XDG_DATA_HOME", "/data")
    assert environment.pointer() == Path("/data/blender_rl_guiding/python")


def test_this_environment_is_whole():
    found = {part.name: part for part in environment.parts(__version__)}
    assert not [part for part in found.values() if part.problem]
    assert found["blender_rl_guiding"].version == __version__
    assert found["torch"].version == metadata.version("torch")


@pytest.mark.parametrize("name", ["torch", "numba", "embreex"])
def test_missing_and_broken_libraries(monkeypatch: pytest.MonkeyPatch, name: str):
    there, load = metadata.version, importlib.import_module

    def version(asked: str) -> str:
        if asked == name:
            raise metadata.PackageNotFoundError(asked)
        return there(asked)

    def broken(module: str) -> object:
        if module.startswith(name):
            raise OSError("libfoo.so: cannot open\nshared object file")
        return load(module)

    with monkeypatch.context() as patch:
        patch.setattr(metadata, "version", version)
        assert faults() == [Part(name, "", "not installed", f"{BUILD} setup")]
    monkeypatch.setattr(importlib, "import_module", broken)
    reason = "does not load: libfoo.so: cannot open shared object file"
    assert faults() == [Part(name, there(name), reason, f"{BUILD} setup {name}")]


def faults(wanted: str = "") -> list[Part]:
    return [part for part in environment.parts(wanted) if part.problem]


def test_a_bare_environment_of_the_wrong_python(tmp_path: Path):
    """A real environment with only the package. The package is installed as if it needed another Python."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(tmp_path)], check=True)
    (packages,) = tmp_path.glob("lib/python*/site-packages")
    (packages / "project.pth").write_text(str(ROOT))
    (packages / "blender_rl_guiding-0.dist-info").mkdir()
    described = "Name: blender_rl_guiding\nVersion: 0\nRequires-Python: ==3.99.*\nRequires-Dist: torch\nRequires-Dist: pyoidn>=2.5\n"
    (packages / "blender_rl_guiding-0.dist-info" / "METADATA").write_text(f"Metadata-Version: 2.4\n{described}")
    command = [str(tmp_path / "bin" / "python"), "-I", "-m", "blender_rl_guiding.environment", "99.0"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    python, package, torch, oidn = (Part(**part) for part in json.loads(done.stdout))
    assert python.problem == f"Python {python.version}, where 3.99 is needed"
    assert package.problem == f"version {__version__}, but the add-on is 99.0; this command makes the zip to install"
    assert package.command == f"{BUILD} extension"
    assert [torch, oidn] == [Part(name, "", "not installed", f"{BUILD} setup") for name in ("torch", "pyoidn")]
    assert len(done.stdout.splitlines()) == 1


SLOW = "import time, blender_rl_guiding.environment as e; e._library = e.Part; e._package = lambda _: print('here', flush=True) or {}"


def test_a_check_that_hangs_ends_with_the_addon():
    command = [sys.executable, "-c", f"{SLOW.format('time.sleep(10000)')}; e.main(['1.0'])"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as child:
        try:
            assert child.stdout
            assert child.stdin
            assert child.stdout.readline() == "here\n"
            child.stdin.close()
            assert child.wait(PATIENCE) == 1
        finally:
            child.kill()


def test_a_check_without_a_pipe_comes_to_its_end():
    """An older add-on gives the check no pipe as stdin."""
    command = [sys.executable, "-c", f"{SLOW.format('time.sleep(0.5) or e.Part(str())')}; e.main(['1.0'])"]
    assert subprocess.run(command, stdin=subprocess.DEVNULL, check=False, capture_output=True, timeout=PATIENCE).returncode == 0
