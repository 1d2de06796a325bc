"""The user's cache. It is used only if nobody else can write to it. If we cannot write to it, nothing is kept.

Kernels are machine code that will run, and a forged reference image looks like a rendered one. Standard library only: the add-on keeps
things, too.
"""

import os
import shlex
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import InputError
from .notices import tell

_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def folder(kind: str, *below: str) -> Path | None:
    """The folder for a kind of things that can be made again, "kernels", "references", "skies" or "checkpoints", or one below it.

    It is made if it is missing. None, and a notice says why, if it cannot be made, or if others can write to it or to a folder above it.
    If we cannot write to it, a notice says so, but its contents can be read.
    """
    home = _home()
    if not home:
        return None
    path = home.joinpath("blender_rl_guiding", kind, *below)
    try:
        _make(home)
        if not (fault := _fault(home, last=False)):
            _make_private(home / "blender_rl_guiding", path)
            _make(path)
            fault = _fault(path, last=True)
        if fault:
            tell(f"{path} is not used: {fault}; XDG_CACHE_HOME can name another cache")
            return None
    except OSError as error:
        _tell_lost(path, error)
        return None
    try:
        tempfile.TemporaryFile(dir=path).close()
    except OSError as error:
        _tell_lost(path, error)
    return path


def _make(path: Path) -> None:
    for place in reversed((path, *path.parents)):
        if not place.exists():
            place.mkdir(mode=0o700, exist_ok=True)


def _make_private(own: Path, path: Path) -> None:
    """Take from others the right to write to our folders, from `own` to `path`: earlier versions left it to the umask.

    Kernels that others may have put there are removed, because they would run. All else is read as anyone's work anyway.
    """
    if not hasattr(os, "getuid"):
        return
    for place in (place for place in reversed((path, *path.parents)) if place.is_relative_to(own) and place.exists()):
        found = place.lstat()
        if found.st_uid == os.getuid() and stat.S_ISDIR(found.st_mode) and found.st_mode & _OTHERS:
            place.chmod(stat.S_IMODE(found.st_mode) & ~_OTHERS)
            if place == own or place.is_relative_to(own / "kernels"):
                _remove(own / "kernels")


def _remove(path: Path) -> None:
    """Move a folder away, then remove it: others may have put files there that we cannot remove, and none must be found again."""
    away = tempfile.mkdtemp(dir=path.parent)
    with suppress(FileNotFoundError):
        path.rename(Path(away, path.name))
    shutil.rmtree(away, ignore_errors=True)


@contextmanager
def dispensable(path: Path) -> Iterator[None]:
    """For a block that writes `path` into the cache: if it cannot, a notice says that nothing is kept, and work goes on."""
    try:
        yield
    except InputError as error:
        _tell_lost(path.parent, error.__cause__ or error)


def _tell_lost(path: Path, error: BaseException) -> None:
    tell(f"nothing is kept in {path} for the next time: {getattr(error, 'strerror', None) or error}")


def _home() -> Path | None:
    given = os.environ.get("XDG_CACHE_HOME", "")
    if given and not os.path.isabs(given):  # invalid by the specification: any folder that we start in could bring its own
        tell(f"XDG_CACHE_HOME is passed over: {given!r} is not an absolute path")
        given = ""
    try:
        return Path(given) if given else Path.home() / ".cache"
    except RuntimeError:
        tell("nothing is kept for the next time: neither HOME nor XDG_CACHE_HOME says where")
        return None


def _fault(path: Path, last: bool) -> str:
    """How others can write to a folder or replace it, in one line; empty if they cannot. `last`: it is the one that we write to."""
    if not hasattr(os, "getuid"):  # Windows, where a user's folders are the user's
        return ""
    places = list(dict.fromkeys(_open_places(path, last)))
    if foreign := [place for place in places if place.lstat().st_uid not in (os.getuid(), 0)]:
        return f"{foreign[0]} belongs to another user"
    if places:
        return f"others can write to {places[0]} (if nobody has, `{shlex.join(['chmod', 'go-w', *map(str, places)])}` mends that)"
    return ""


def _open_places(path: Path, last: bool) -> Iterator[Path]:
    """The folders on a path, its links followed, that belong to another user or that others can write to."""
    for place in (path, *path.parents):
        found, own = place.lstat(), last and place == path
        if found.st_uid not in (os.getuid(), 0):
            yield place
        elif stat.S_ISLNK(found.st_mode):
            yield from _open_places(place.parent / os.readlink(place), own)
        elif found.st_mode & _OTHERS and (own or not found.st_mode & stat.S_ISVTX):
            yield place  # above the last, a sticky bit is enough, as on /tmp: users can remove only their own files
