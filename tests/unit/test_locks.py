"""A folder has one writer at a time; other writers are told the name of this one. A lock ends with its process."""

import errno
import fcntl
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from blender_rl_guiding import locks
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.locks import LOCK, writing
from tests.patience import PATIENCE

ROOT = Path(__file__).resolve().parents[2]
HOLDS = """
import sys
from pathlib import Path
from blender_rl_guiding.locks import writing
with writing(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""
COUNTS = """
import os, sys
from pathlib import Path
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.locks import writing
folder, alone, entered = Path(sys.argv[1]), Path(sys.argv[2]), 0
for _ in range(1500):
    try:
        with writing(folder):
            os.close(os.open(alone, os.O_CREAT | os.O_EXCL))  # fails if another is inside
            entered += 1
            os.unlink(alone)
    except InputError as error:
        assert "is being written to by" in str(error) or "others lock it all the time" in str(error), error
print(entered)
"""


def process(script: str, *arguments: Path) -> "subprocess.Popen[str]":
    pipe = subprocess.PIPE
    return subprocess.Popen([sys.executable, "-c", script, *map(str, arguments)], stdin=pipe, stdout=pipe, stderr=pipe, text=True, cwd=ROOT)


@pytest.fixture
def holder(tmp_path: Path) -> Iterator["subprocess.Popen[str]"]:
    """A process that holds the lock of the folder "out"."""
    with process(HOLDS, tmp_path / "out") as holder:
        assert holder.stdout
        assert holder.stdout.readline() == "held\n"
        yield holder
        holder.kill()


def test_a_second_writer_is_told_who_the_first_is(holder: "subprocess.Popen[str]", tmp_path: Path):
    for _ in range(2):
        with pytest.raises(InputError, match=rf"out is being written to by process {holder.pid} on \S+ since .* \(-c .*\): wait"):
            writing(tmp_path / "out").__enter__()
    with writing(tmp_path / "other"):
        pass
    holder.communicate(timeout=PATIENCE)
    with writing(tmp_path / "out"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_whatever_ends_the_first_frees_the_folder(holder: "subprocess.Popen[str]", tmp_path: Path):
    holder.send_signal(signal.SIGKILL)
    holder.wait(PATIENCE)
    assert (tmp_path / "out" / LOCK).exists()
    with writing(tmp_path / "out"):
        assert f"process {os.getpid()} on" in (tmp_path / "out" / LOCK).read_text()
    assert list((tmp_path / "out").iterdir()) == []


def test_of_several_that_make_lock_and_remove_a_folder_never_two_are_inside(tmp_path: Path):
    children = [process(COUNTS, tmp_path / "made" / "out", tmp_path / "alone") for _ in range(3)]
    for child in children:
        said, complained = child.communicate(timeout=PATIENCE)
        assert child.returncode == 0, complained
        assert int(said) > 0
    assert [path for path in tmp_path.rglob("*") if not path.is_dir()] == []


def test_what_was_made_is_removed_where_nothing_was_written(tmp_path: Path):
    (tmp_path / "mine").mkdir()
    with writing(tmp_path / "mine" / "a" / "b", tmp_path / "c"):
        assert (tmp_path / "mine" / "a" / "b").is_dir()
    assert [path.name for path in tmp_path.rglob("*")] == ["mine"]
    with writing(tmp_path / "mine" / "a" / "b"):
        (tmp_path / "mine" / "a" / "file").touch()
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a", "file", "mine"]


def test_of_several_folders_all_or_none_are_held(tmp_path: Path):
    with writing(tmp_path / "b"):
        with pytest.raises(InputError, match="b is being written to"):
            writing(tmp_path / "a", tmp_path / "b", tmp_path / "c").__enter__()
        with writing(tmp_path / "a"):
            pass
    with pytest.raises(InputError, match="a is being written to"):
        writing(tmp_path / "a", tmp_path / "a").__enter__()


@pytest.mark.parametrize("said", ["", "\x1b[31mred\nlines\r\x00", "x" * 5000, "\ud800 half", "é"], ids=ascii)
def test_what_a_holder_says_is_shown_in_one_line_whatever_it_is(said: str, tmp_path: Path):
    (tmp_path / LOCK).write_bytes(said.encode(errors="surrogatepass"))
    with (tmp_path / LOCK).open() as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        with pytest.raises(InputError) as caught:
            writing(tmp_path).__enter__()
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < 1000


def test_a_lock_that_is_a_link_is_not_followed(tmp_path: Path):
    precious = tmp_path / "precious"
    precious.write_text("mine")
    (tmp_path / "out").mkdir()
    for target in (precious, tmp_path / "none", tmp_path / "out" / LOCK):
        (tmp_path / "out" / LOCK).symlink_to(target)
        with pytest.raises(InputError, match=r"cannot write to .*out: "):
            writing(tmp_path / "out").__enter__()
        (tmp_path / "out" / LOCK).unlink()
    assert precious.read_text() == "mine"
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL])
def test_a_file_system_without_locks_costs_a_line(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def refuse(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    told: list[str] = []
    monkeypatch.setattr(fcntl, "flock", refuse)
    monkeypatch.setattr(locks, "tell", told.append)
    with writing(tmp_path):
        (tmp_path / "file").touch()
    assert told == [f"{tmp_path} cannot be locked ({os.strerror(number)}): take care that nothing else writes to it"]
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("below", ["file", "file/x", "file/x/y"])
def test_a_folder_that_cannot_be_is_one_line(below: str, tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"^cannot write to .*: .*file is not a folder$"):
        writing(tmp_path / below).__enter__()
