"""The user's cache: where it is, that nobody else can have put anything there, and what happens where it cannot be written.

Kernels are machine code that will run, and nothing tells a forged reference image from a rendered one. Standard library only: the
add-on keeps things, too.
"""

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InputError
from .notices import tell


def folder(kind: str, *below: str) -> Path | None:
    """The folder, made if need be, for a kind of what can be made again, "kernels", "references", "skies" or "checkpoints", or one in it.

    None, and a line tells why, where there can be none, or others could write to it or to a folder that it lies in. A line tells, too,
    where we cannot write to it; what it holds can be read all the same.
    """
    home = _home()
    if not home:
        return None
    path = home.joinpath("blender_rl_guiding", kind, *below)
    try:
        for place in reversed((path, *path.parents)):
            if not place.exists():
                place.mkdir(mode=0o700, exist_ok=True)
        if fault := _fault(path, last=True):
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


@contextmanager
def dispensable(path: Path) -> Iterator[None]:
    """For a block that writes `path` into the cache: where it cannot, a line tells that nothing is kept, and that is all."""
    try:
        yield
    except InputError as error:
        _tell_lost(path.parent, error.__cause__ or error)


def _tell_lost(path: Path, error: BaseException) -> None:
    tell(f"nothing is kept in {path} for the next time: {getattr(error, 'strerror', None) or error}")


def _home() -> Path | None:
    given = os.environ.get("XDG_CACHE_HOME", "")
    if given and not os.path.isabs(given):  # invalid by the specification: each folder that we were started in could bring its own
        tell(f"XDG_CACHE_HOME is passed over: {given!r} is not an absolute path")
        given = ""
    try:
        return Path(given) if given else Path.home() / ".cache"
    except RuntimeError:
        tell("nothing is kept for the next time: neither HOME nor XDG_CACHE_HOME says where")
        return None


def _fault(path: Path, last: bool) -> str:
    """How others can write to a folder, or put another in its place; empty where they cannot. `last` is for the one that is written to."""
    if not hasattr(os, "getuid"):  # Windows, where a user's folders are the user's
        return ""
    for place in (path, *path.parents):
        found, own = place.lstat(), last and place == path
        if found.st_uid not in (os.getuid(), 0):
            return f"{place} belongs to another user"
        if stat.S_ISLNK(found.st_mode):
            if fault := _fault(place.parent / os.readlink(place), own):
                return fault
        elif found.st_mode & (stat.S_IWGRP | stat.S_IWOTH) and (own or not found.st_mode & stat.S_ISVTX):
            # Elsewhere a sticky bit is enough, as that of /tmp: each removes only what is their own.
            return f"others can write to {place} (if nobody has, `chmod go-w {place}` mends that)"
    return ""
