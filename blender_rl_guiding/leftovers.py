"""Names temporary files and folders after their process, and removes those of processes that were killed."""

import contextlib
import functools
import hashlib
import os
import platform
import re
import shutil
import stat
import tempfile
import time
from pathlib import Path

_OLD = 7 * 24 * 3600.0  # seconds after which leftovers count as dead if they are of another computer, or of this one before its last start
_SIGNALS = os.name == "posix"  # on other systems os.kill ends the process that it asks about
# Names given by `part_of` and `temporary_folder`. Folders are hidden by a dot, except where the system has its temporary files.
_FILE = re.compile(r"\..+\.rlg-(\d+)-([0-9a-f]{8})(\.[^.\n]*)?")
_FOLDER, _HIDDEN = (re.compile(dot + r"rlg-(\d+)-([0-9a-f]{8})-[a-z0-9_]{8}") for dot in ("", r"\."))


def part_of(path: Path) -> Path:
    """The temporary name beside `path` for this process, with the same suffix: .STEM.rlg-PID-COMPUTER.SUFFIX."""
    return path.with_name(f".{path.stem}.{_own()}{path.suffix}")


def temporary_folder(beside: Path | None = None) -> "tempfile.TemporaryDirectory[str]":
    """A temporary folder, hidden in `beside` or, without it, among the system's temporary files; sweeps there first."""
    place = beside or Path(tempfile.gettempdir())
    sweep(place)
    return tempfile.TemporaryDirectory(prefix=f"{'.' if beside else ''}{_own()}-", dir=place)


_SWEPT: set[Path] = set()


def sweep_once(folder: Path) -> None:
    """`sweep`, the first time that this process asks for the folder."""
    if folder not in _SWEPT:
        _SWEPT.add(folder)
        sweep(folder)


def sweep(folder: Path) -> None:
    """Remove the temporary files and folders of dead processes directly in `folder`, if it exists.

    Nothing else is touched, and no link is followed. What cannot be removed stays.
    """
    folders = _FOLDER if folder == Path(tempfile.gettempdir()) else _HIDDEN
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if "rlg-" in entry.name:
                with contextlib.suppress(OSError):  # another start sweeps at the same time, or it is another user's
                    is_folder = entry.is_dir(follow_symlinks=False)
                    name = (folders if is_folder else _FILE).fullmatch(entry.name)
                    if name and _is_dead(int(name[1]), name[2], entry):
                        _remove(entry)


def _is_dead(process: int, computer: str, entry: os.DirEntry[str]) -> bool:
    """This computer knows its own processes; a leftover of another computer has to be old."""
    if computer == _computer() and _SIGNALS:
        return not _is_alive(process)
    return time.time() - entry.stat(follow_symlinks=False).st_mtime > _OLD


def _is_alive(process: int) -> bool:
    """Whether a process has that number. It may be a later one: the leftovers are then swept after that has ended."""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    with contextlib.suppress(OSError):  # one that has ended keeps its number until its parent waits for it; in a container none may do so
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    return True


def _remove(entry: os.DirEntry[str]) -> None:
    mode = entry.stat(follow_symlinks=False).st_mode
    if stat.S_ISDIR(mode):
        shutil.rmtree(entry.path)
    elif stat.S_ISREG(mode):
        os.unlink(entry.path)


def _own() -> str:
    return f"rlg-{os.getpid()}-{_computer()}"


@functools.cache
def _computer() -> str:
    """Eight digits that name one set of process numbers: those of this computer since its start, and of this container on it."""
    told = [platform.node()]
    with contextlib.suppress(OSError):  # only Linux has them
        told = [Path("/proc/sys/kernel/random/boot_id").read_text(), str(os.stat("/proc/self/ns/pid").st_ino)]
    return hashlib.sha256("".join(told).encode()).hexdigest()[:8]
