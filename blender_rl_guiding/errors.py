"""The exception for bad input, and functions that write files without ever leaving a half-written file."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from .leftovers import part_of, sweep_once
from .strings import printable


class InputError(Exception):
    """The user's input cannot be used. The message is one line that names the input, and is safe on any terminal."""

    def __init__(self, text: str) -> None:
        super().__init__(printable(text))


@contextlib.contextmanager
def trying_to(action: str) -> Iterator[None]:
    """An OSError of the block becomes an InputError: "cannot ACTION: REASON"."""
    try:
        yield
    except OSError as error:
        raise InputError(f"cannot {action}: {error.strerror or error}") from error


@contextlib.contextmanager
def atomic(path: Path, durable: bool = True) -> Iterator[Path]:
    """Yields a temporary name beside `path` to write to. On success this file replaces `path`; on failure it is removed.

    The name keeps the suffix of `path`. Temporary files of killed processes in the folder are removed. A `durable` file is on the disk when
    the block ends, so it survives a loss of power; cached files can be made again and need not be durable. InputError if it cannot be
    written.
    """
    part = part_of(path)
    try:
        with trying_to(f"write {path}"):
            path.parent.mkdir(parents=True, exist_ok=True)
            sweep_once(path.parent)
            part.unlink(missing_ok=True)  # otherwise a link with that name, perhaps from another user, would be followed
            yield part
            if durable:
                _to_disk(part)
            os.replace(part, path)
        if durable:
            with contextlib.suppress(OSError):  # some file systems cannot sync folders; the file itself is written
                _to_disk(path.parent)
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def _to_disk(path: Path) -> None:
    """Wait until a file's contents, or a folder's names, are on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def check_writable(folder: Path) -> None:
    """InputError if no file can be written below `folder`. The folder need not exist. Call this before hours of work.

    It creates no folder, so that a command that fails for another reason leaves nothing behind.
    """
    nearest = next(place for place in (folder, *folder.absolute().parents) if os.path.exists(place))
    if not os.path.isdir(nearest):
        raise InputError(f"cannot write to {folder}: {nearest} is not a folder")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise InputError(f"cannot write to {folder}: no permission to write to {nearest}")


def check_inside(folder: Path, path: Path) -> None:
    """InputError if `path`, which is below `folder` by its name, leads out of `folder` through a link. A stranger may have made such a
    link.
    """
    if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder)):
        raise InputError(f"{path} leads out of {folder}, by a link")
