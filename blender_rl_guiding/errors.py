"""The one exception for bad input, and writing files so that nothing is ever left half-written."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from .leftovers import part_of, sweep_once
from .strings import printable


class InputError(Exception):
    """Something that the user gave cannot be used. The message is one line that names it, and is safe on any terminal."""

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
    """Give a temporary name beside `path` to write to; that file takes the place of `path` on success and vanishes on failure.

    The name keeps the suffix of `path`. Files that killed processes left in the folder are removed. A `durable` file is on the disk when
    the block ends, and survives a loss of power; files that can be made again need not be. InputError if it cannot be written.
    """
    part = part_of(path)
    try:
        with trying_to(f"write {path}"):
            path.parent.mkdir(parents=True, exist_ok=True)
            sweep_once(path.parent)
            part.unlink(missing_ok=True)  # a link of that name, which somebody else may have made, would be followed
            yield part
            if durable:
                _to_disk(part)
            os.replace(part, path)
        if durable:
            with contextlib.suppress(OSError):  # not every file system syncs folders, and the file is there
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
    """InputError if no file could be written below `folder`, which need not exist yet: to be asked before hours of work.

    Makes nothing: a command that fails for another reason leaves nothing behind.
    """
    nearest = next(place for place in (folder, *folder.absolute().parents) if os.path.exists(place))
    if not os.path.isdir(nearest):
        raise InputError(f"cannot write to {folder}: {nearest} is not a folder")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise InputError(f"cannot write to {folder}: no permission to write to {nearest}")


def check_inside(folder: Path, path: Path) -> None:
    """InputError if `path`, which is below `folder` by its name, leads out of it by a link: somebody else may have made that."""
    if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder)):
        raise InputError(f"{path} leads out of {folder}, by a link")
