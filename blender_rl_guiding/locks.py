"""Locks folders of results: only one program at a time writes to a folder, and the lock file has its name."""

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

LOCK = ".lock"  # the lock file in a folder
_TRIES = 100  # attempts to lock a folder while others make, lock and remove it


@contextlib.contextmanager
def writing(*folders: Path) -> Iterator[None]:
    """In the block the folders exist, are writable, and are locked: no other process in such a block writes to them.

    InputError if that is not possible; it names the process with the lock. Folders that are made here are removed if they stay empty.
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
            with contextlib.suppress(OSError):  # the lock file is removed while the lock is held, see `_is_there`
                (folder / LOCK).unlink()
            os.close(lock)
    finally:
        with contextlib.suppress(OSError):  # there is something in it
            for place in made:
                place.rmdir()


def _locked(folder: Path) -> int:
    """The descriptor that holds the lock. If the process ends in any way, the system frees the lock."""
    path = folder / LOCK
    for _ in range(_TRIES):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)  # because a link in a stranger's folder could lead anywhere
        except FileNotFoundError:
            continue  # the process that made the folder has just removed it
        except OSError as error:
            raise InputError(f"cannot write to {folder}: {error.strerror or error}") from error
        if _lock(lock, folder) and _is_there(lock, path):
            return lock
        os.close(lock)
    raise InputError(f"cannot write to {folder}: others lock it all the time")


def _lock(lock: int, folder: Path) -> bool:
    """Lock the file. If the file system has no locks, a notice says so. InputError if another process holds the lock."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        holder = _holder(lock)
        os.close(lock)
        raise InputError(f"{folder} is being written to by {holder}: wait for it, or choose another folder") from error
    except OSError as error:
        tell(f"{folder} cannot be locked ({error.strerror or error}): take care that nothing else writes to it")
    with contextlib.suppress(OSError):  # on a full disk the lock works without a name
        os.ftruncate(lock, 0)
        os.write(lock, _ourselves().encode(errors="replace"))
    return True


def _is_there(lock: int, path: Path) -> bool:
    """Whether the locked file still has its name. Its last holder may have removed it after we opened it."""
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
