"""The user's cache is used only if it is private. If the cache is not writable, a line says so, and the program goes on."""

import errno
import os
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from blender_rl_guiding import cache, notices
from blender_rl_guiding.errors import InputError, atomic

KINDS = ["kernels", "references", "skies", "checkpoints"]


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    home = tmp_path / "own" / "cache"
    monkeypatch.setenv("XDG_CACHE_HOME", str(home))
    monkeypatch.setattr(notices, "_TOLD", set())
    return home


@pytest.fixture
def told(home: Path) -> Iterator[list[str]]:
    lines: list[str] = []
    with notices.heard_by(lines.append):
        yield lines


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("umask", [0o022, 0o002, 0o000])
def test_the_folder_is_made_for_its_owner_alone(kind: str, umask: int, home: Path, told: list[str]):
    before = os.umask(umask)
    try:
        folder = cache.folder(kind, "below")
    finally:
        os.umask(before)
    assert folder == home / "blender_rl_guiding" / kind / "below"
    assert folder
    for place in (folder, folder.parent, folder.parents[1], home, home.parent):
        assert stat.S_IMODE(place.stat().st_mode) == 0o700
    assert told == []


OPENINGS = {
    "for its group": lambda place: place.chmod(0o770),
    "for all": lambda place: place.chmod(0o757),
    "of another": lambda place: os.chown(place, 12345, -1),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("opening", "place"), [*((opening, "../../..") for opening in OPENINGS), *(("of another", place) for place in (".", "..", "../.."))]
)
def test_a_folder_that_others_can_write_to_is_not_used(kind: str, opening: str, place: str, home: Path, told: list[str]):
    folder = cache.folder(kind)
    assert folder
    if opening == "of another" and os.getuid():
        pytest.skip("only the superuser can give folders away")
    opened = (folder / place).resolve()
    OPENINGS[opening](opened)
    assert cache.folder(kind) is None
    (line,) = told
    assert line.startswith(f"{folder} is not used: ")
    assert str(opened) in line
    assert cache.folder(kind) is None
    assert len(told) == 1  # one line in all
    opened.chmod(0o755)
    if opening != "of another":
        assert cache.folder(kind) == folder


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", [0o775, 0o770, 0o757, 0o1777])
@pytest.mark.parametrize("open_ones", [[".", "..", "../.."], ["."], [".."], ["../.."]])
def test_what_is_ours_is_closed_and_code_that_was_open_to_others_removed(
    kind: str, mode: int, open_ones: list[str], home: Path, told: list[str]
):
    """An earlier version made such a folder if the umask let groups write."""
    kernel, folder = cache.folder("kernels", "below"), cache.folder(kind, "below")
    assert kernel
    assert folder
    for place in {kernel, folder}:
        (place / "kept").touch()
    for place in open_ones:
        (folder / place).resolve().chmod(mode)
    assert cache.folder(kind, "below") == folder
    assert (kernel / "kept").exists() == (kind != "kernels" and "../.." not in open_ones)
    assert (folder / "kept").exists() == (kind != "kernels")
    for place in (folder, folder.parent, folder.parents[1]):
        assert not place.stat().st_mode & 0o022
    assert {path.name for path in (home / "blender_rl_guiding").iterdir()} <= set(KINDS)
    assert told == []
    (folder / "kept").touch()
    assert cache.folder(kind, "below") == folder
    assert (folder / "kept").exists()  # removed once, not at each call


def test_code_that_cannot_be_removed_is_not_found_either(home: Path, told: list[str], monkeypatch: pytest.MonkeyPatch):
    folder = cache.folder("kernels", "below")
    assert folder
    (folder / "forged").touch()
    folder.parent.chmod(0o775)
    monkeypatch.setattr(shutil, "rmtree", lambda *args, **options: None)
    assert cache.folder("kernels", "below") == folder
    assert not list(folder.iterdir())


def test_one_command_closes_all_folders_above(home: Path, told: list[str]):
    home.mkdir(parents=True)
    for place in (home, home.parent):
        place.chmod(0o775)
    assert cache.folder("skies") is None
    (line,) = told
    assert f"`chmod go-w {home} {home.parent}` mends that" in line
    subprocess.run(line.split("`")[1], shell=True, check=True)
    assert cache.folder("skies")


def test_a_sticky_folder_above_is_as_good_as_ones_own(home: Path, told: list[str]):
    home.parent.mkdir()
    home.parent.chmod(0o1777)
    assert cache.folder("skies")


@pytest.mark.parametrize("mode", [0o755, 0o777, 0o1777])
def test_links_are_followed_to_where_others_could_write(mode: int, home: Path, tmp_path: Path, told: list[str]):
    elsewhere = tmp_path / "shared" / "cache"
    elsewhere.mkdir(parents=True)
    elsewhere.parent.chmod(mode)
    home.parent.mkdir()
    home.symlink_to("../shared/cache")
    assert (cache.folder("kernels") is None) == (mode == 0o777)
    assert len(told) == (mode == 0o777)


@pytest.mark.parametrize("given", ["cache", "./cache", "../cache", "~/cache"])
def test_a_relative_cache_is_passed_over(given: str, home: Path, told: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path / "user"))
    monkeypatch.setenv("XDG_CACHE_HOME", given)
    assert cache.folder("kernels") == tmp_path / "user" / ".cache" / "blender_rl_guiding" / "kernels"
    assert told == [f"XDG_CACHE_HOME is passed over: {given!r} is not an absolute path"]


@pytest.mark.parametrize("kind", KINDS)
def test_without_a_place_nothing_is_kept(kind: str, home: Path, told: list[str], monkeypatch: pytest.MonkeyPatch):
    home.parent.mkdir()
    home.touch()
    assert cache.folder(kind) is None
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/cache")
    assert cache.folder(kind) is None
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr(Path, "home", lambda: (_ for _ in ()).throw(RuntimeError))
    assert cache.folder(kind) is None
    assert len(told) == 3
    assert all(line.startswith("nothing is kept") for line in told)


@pytest.mark.parametrize("number", [errno.EROFS, errno.EACCES, errno.ENOSPC, errno.EDQUOT])
def test_what_cannot_be_written_can_be_read_and_is_told_once(number: int, home: Path, told: list[str], monkeypatch: pytest.MonkeyPatch):
    def refuse(*_args: object, **_options: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(tempfile, "TemporaryFile", refuse)
    folder = cache.folder("references")
    assert folder == home / "blender_rl_guiding" / "references"
    assert folder
    monkeypatch.setattr(os, "replace", refuse)
    for name in ("a", "b"):
        with cache.dispensable(folder / name), atomic(folder / name) as part:
            part.touch()
    assert told == [f"nothing is kept in {folder} for the next time: {os.strerror(number)}"]
    assert list(folder.iterdir()) == []


def test_lines_reach_who_listens(home: Path):
    heard: list[str] = []
    with notices.heard_by(heard.append):
        with cache.dispensable(home / "a"):
            raise InputError("reason")
        notices.tell("a line")
        notices.tell("a line")
    notices.tell("another")
    assert heard == [f"nothing is kept in {home} for the next time: reason", "a line"]
