"""The user's cache. It is used only if no other user can write to it. If we cannot write to it, nothing is stored.

The reason: cached kernels are machine code that will run, and a forged reference looks like a rendered one. Standard library only, because
the add-on uses the cache, too.
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
    """The folder for one kind of cached files, "kernels", "references", "skies" or "checkpoints", or a folder below it.

    If the folder is missing, it is made. If it cannot be made, or if others can write to it or to a folder above it, None; a notice has the
    reason. If we cannot write to it, a notice says so, but we can read its contents.
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
    """Remove the write permission of others from our folders, from `own` to `path`. Earlier versions used the umask's permissions.

    Existing kernels are removed, because others may have put them there and they would run. All other files are checked when they are read.
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
    """Rename a folder, then remove it. Others may have put files there that we cannot remove; after the rename nobody finds them."""
    away = tempfile.mkdtemp(dir=path.parent)
    with suppress(FileNotFoundError):
        path.rename(Path(away, path.name))
    shutil.rmtree(away, ignore_errors=True)


@contextmanager
def dispensable(path: Path) -> Iterator[None]:
    """For a block that writes `path` into the cache. If it fails, a notice says that nothing is stored, and work goes on."""
    try:
        yield
    except InputError as error:
        _tell_lost(path.parent, error.__cause__ or error)


def _tell_lost(path: Path, error: BaseException) -> None:
    tell(f"nothing is kept in {path} for the next time: {getattr(error, 'strerror', None) or error}")


def _home() -> Path | None:
    given = os.environ.get("XDG_CACHE_HOME", "")
    if given and not os.path.isabs(given):  # invalid by the specification: the current folder may contain a stranger's cache
        tell(f"XDG_CACHE_HOME is passed over: {given!r} is not an absolute path")
        given = ""
    try:
        return Path(given) if given else Path.home() / ".cache"
    except RuntimeError:
        tell("nothing is kept for the next time: neither HOME nor XDG_CACHE_HOME names a folder")
        return None


def _fault(path: Path, last: bool) -> str:
    """A line with the reason why others can write to a folder or replace it; empty if they cannot. `last`: whether we write to this
    folder.
    """
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
            yield place  # for folders above the last a sticky bit is enough, as on /tmp: users can remove only their own files
