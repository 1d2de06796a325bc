"""Files of killed processes are removed, and no other files."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from blender_rl_guiding import leftovers
from blender_rl_guiding.errors import atomic
from blender_rl_guiding.leftovers import sweep, temporary_folder
from tests.patience import PATIENCE

ELSEWHERE = "0123abcd"  # another computer, or another start of this one


@pytest.fixture
def dead() -> int:
    """The id of a process that has ended."""
    child = subprocess.Popen(["true"])
    child.wait(PATIENCE)
    return child.pid


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def make(folder: Path, name: str, age: float = 0.0) -> Path:
    """Make a file; or a folder with a file in it, if the name ends in a slash."""
    path = folder / name
    if name.endswith("/"):
        path.mkdir()
        (path / "inside").touch()
    else:
        path.touch()
    os.utime(path, (time.time() - age,) * 2)
    return path


def test_what_the_dead_left_goes_and_what_the_living_have_stays(dead: int, tmp_path: Path):
    here = leftovers._computer()
    gone = [f".image.rlg-{dead}-{here}.exr", f".noext.rlg-{dead}-{here}", f".rlg-{dead}-{here}-x1y2z3_4/"]
    kept = [f".image.rlg-{os.getpid()}-{here}.exr", f".rlg-{os.getpid()}-{here}-x1y2z3_4/", f".image.rlg-1-{here}.exr", "image.exr"]
    for name in gone + kept:
        make(tmp_path, name, age=1e9)
    sweep(tmp_path)
    assert names(tmp_path) == {name.rstrip("/") for name in kept}


def test_folders_that_are_not_hidden_go_only_where_the_system_has_its_own(dead: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(leftovers.tempfile, "gettempdir", lambda: str(tmp_path))
    make(tmp_path, f"rlg-{dead}-{leftovers._computer()}-x1y2z3_4/")
    make(tmp_path, f"rlg-{dead}-{leftovers._computer()}/")
    sweep(tmp_path)
    assert names(tmp_path) == {f"rlg-{dead}-{leftovers._computer()}"}


def test_who_has_ended_is_dead_though_nobody_has_asked(tmp_path: Path):
    with subprocess.Popen(["true"]) as child:
        os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
        make(tmp_path, f".image.rlg-{child.pid}-{leftovers._computer()}.exr")
        sweep(tmp_path)
    assert not names(tmp_path)


@pytest.mark.parametrize(("days", "stays"), [(6, True), (8, False)])
def test_what_is_of_another_computer_has_to_be_old(days: int, stays: bool, dead: int, tmp_path: Path):
    make(tmp_path, f".image.rlg-{dead}-{ELSEWHERE}.exr", days * 86400)
    make(tmp_path, f".rlg-{os.getpid()}-{ELSEWHERE}-x1y2z3_4/", days * 86400)
    sweep(tmp_path)
    assert bool(names(tmp_path)) == stays


@pytest.mark.parametrize(
    "name",
    [
        ".hidden.123.exr",
        ".image.{dead}.exr",
        "image.rlg-{dead}-{here}.exr",
        ".rlg-{dead}-{here}x",
        ".rlg-{dead}-{here}0/",
        ".rlg-x-{here}-y/",
        "my-rlg-{dead}-{here}-x/",
        ".rlg--{here}-x",
        ".image.rlg-{dead}.exr",
        ".image.RLG-{dead}-{here}.exr",
        ".image.rlg-{dead}-{here}.exr\n",
        ".image.rlg-{dead}-{here}.exr/",
        ".rlg-{dead}-{here}-x1y2z3_4",
        "rlg-{dead}-{here}-x1y2z3_4/",
        "rlg-20260101-1a2b3c4d.exr",
        "rlg-4711-deadbeef/",
        ".config.rlg-7-0badcafe/",
    ],
)
def test_other_names_are_left_alone(name: str, dead: int, tmp_path: Path):
    path = make(tmp_path, name.format(dead=dead, here=leftovers._computer()), age=1e9)
    sweep(tmp_path)
    assert path.exists()


def test_no_link_is_followed_and_none_removed(dead: int, tmp_path: Path):
    there, swept = tmp_path / "there", tmp_path / "swept"
    there.mkdir()
    swept.mkdir()
    (there / "precious").touch()
    left = f"rlg-{dead}-{leftovers._computer()}"
    (swept / f".{left}-x1y2z3_4").symlink_to(there)
    (swept / f".image.{left}.exr").symlink_to(there / "precious")
    folder = make(swept, f".{left}-y1y2z3_4/")
    (folder / "link").symlink_to(there)
    sweep(swept)
    assert (there / "precious").exists()
    assert names(swept) == {f".{left}-x1y2z3_4", f".image.{left}.exr"}


def test_folders_that_cannot_be_swept_are_none_of_its_business(tmp_path: Path):
    sweep(tmp_path / "missing")
    (tmp_path / "file").touch()
    sweep(tmp_path / "file")


def test_a_number_that_no_process_can_have(tmp_path: Path):
    make(tmp_path, f".image.rlg-{10**30}-{leftovers._computer()}.exr")
    sweep(tmp_path)
    assert not names(tmp_path)


def test_without_numbers_of_processes_age_decides(dead: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """On systems that are not POSIX, the call that checks whether a process is alive may end the process."""
    monkeypatch.setattr(leftovers.os, "kill", None)
    monkeypatch.setattr(leftovers, "_SIGNALS", False)
    make(tmp_path, f".image.rlg-{dead}-{leftovers._computer()}.exr")
    make(tmp_path, f".image.rlg-{os.getpid()}-{leftovers._computer()}.exr", age=1e9)
    sweep(tmp_path)
    assert names(tmp_path) == {f".image.rlg-{dead}-{leftovers._computer()}.exr"}


WRITER = """
import os, signal, sys
from pathlib import Path
from blender_rl_guiding.errors import atomic
from blender_rl_guiding.leftovers import temporary_folder
folder = Path(sys.argv[1])
with atomic(folder / "image.exr") as part, temporary_folder(folder) as beside, temporary_folder() as elsewhere:
    part.write_bytes(b"half")
    Path(beside, "bundle.npz").write_bytes(b"half")
    Path(elsewhere, "bundle.npz").write_bytes(b"half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_the_next_start_removes_all_that_a_killed_one_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    work, temporary = tmp_path / "work", tmp_path / "tmp"
    work.mkdir()
    temporary.mkdir()
    subprocess.run([sys.executable, "-c", WRITER, str(work)], env=os.environ | {"TMPDIR": str(temporary)}, timeout=PATIENCE)
    assert (len(names(work)), len(names(temporary))) == (2, 1)
    monkeypatch.setattr(leftovers.tempfile, "tempdir", str(temporary))
    with temporary_folder(work), temporary_folder(), atomic(work / "image.exr") as part:
        part.write_bytes(b"whole")
        assert (len(names(work)), len(names(temporary))) == (2, 1)  # its own files
    assert (names(work), names(temporary)) == ({"image.exr"}, set())
