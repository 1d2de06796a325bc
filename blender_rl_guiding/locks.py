"""Locks folders of results: one program at a time writes to each, and the lock names it."""

import contextlib
import fcntl
import os
import platform
import shlex
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from .errors import InputError, check_writable
from .notices import tell

LOCK = ".lock"  # the file that a folder is locked by
_TRIES = 100  # to lock a folder that others make, lock and remove meanwhile


@contextlib.contextmanager
def writing(*folders: Path) -> Iterator[None]:
    """For the length of the block the folders exist, can be written to, and are locked: nobody else in a block like this writes to them.

    InputError if that cannot be; it names the process that holds a lock. Folders made here are removed if they stay empty.
    """
    with contextlib.ExitStack() as stack:
        for folder in folders:
            stack.enter_context(_writing(folder))
        yield


@contextlib.contextmanager
def _writing(folder: Path) -> Iterator[None]:
    check_writable(folder)
    made = [place for place in (folder, *folder.parents) if not os.path.exists(place)]
    try:
        lock = _locked(folder)
        try:
            yield
        finally:
            with contextlib.suppress(OSError):  # it is removed while it is held: see `_is_there`
                (folder / LOCK).unlink()
            os.close(lock)
    finally:
        with contextlib.suppress(OSError):  # there is something in it
            for place in made:
                place.rmdir()


def _locked(folder: Path) -> int:
    """The descriptor that holds the lock; whatever ends the process frees it."""
    path = folder / LOCK
    for _ in range(_TRIES):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)  # a link, in a folder of others, could lead anywhere
        except FileNotFoundError:
            continue  # the process that made the folder has just removed it
        except OSError as error:
            raise InputError(f"cannot write to {folder}: {error.strerror or error}") from error
        if _lock(lock, folder) and _is_there(lock, path):
            return lock
        os.close(lock)
    raise InputError(f"cannot write to {folder}: others lock it all the time")


def _lock(lock: int, folder: Path) -> bool:
    """Lock the file, or tell by a notice that the file system has no locks. InputError if another process holds the lock."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        holder = _holder(lock)
        os.close(lock)
        raise InputError(f"{folder} is being written to by {holder}: wait for it, or choose another folder") from error
    except OSError as error:
        tell(f"{folder} cannot be locked ({error.strerror or error}): take care that nothing else writes to it")
    with contextlib.suppress(OSError):  # a full disk: the lock holds without a name
        os.ftruncate(lock, 0)
        os.write(lock, _ourselves().encode(errors="replace"))
    return True


def _is_there(lock: int, path: Path) -> bool:
    """Whether the locked file is the one that others find: its last holder may have removed it since it was opened."""
    try:
        return os.path.samestat(os.fstat(lock), path.stat())
    except FileNotFoundError:
        return False


def _ourselves() -> str:
    return f"process {os.getpid()} on {platform.node()} since {time.strftime('%Y-%m-%d %H:%M')} ({shlex.join(sys.argv)[:160]})"


def _holder(lock: int) -> str:
    """The holder's name, in one line of printable characters."""
    said = os.pread(lock, 400, 0).decode(errors="replace")
    return "".join(c if c.isprintable() else " " for c in said).strip() or "another program"
