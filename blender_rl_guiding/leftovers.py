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

_OLD = 7 * 24 * 3600.0  # seconds; older leftovers of another computer, or of this one before its last start, count as dead
_SIGNALS = os.name == "posix"  # on other systems os.kill(pid, 0) would end the process
# Names from `part_of` and `temporary_folder`. They begin with a dot, except folders among the system's temporary files.
_FILE = re.compile(r"\..+\.rlg-(\d+)-([0-9a-f]{8})(\.[^.\n]*)?")
_FOLDER, _HIDDEN = (re.compile(dot + r"rlg-(\d+)-([0-9a-f]{8})-[a-z0-9_]{8}") for dot in ("", r"\."))


def part_of(path: Path) -> Path:
    """The temporary name beside `path` for this process, with the same suffix: .STEM.rlg-PID-COMPUTER.SUFFIX."""
    return path.with_name(f".{path.stem}.{_own()}{path.suffix}")


def temporary_folder(beside: Path | None = None) -> "tempfile.TemporaryDirectory[str]":
    """A temporary folder: hidden in `beside`, or without `beside` among the system's temporary files. It first sweeps this place."""
    place = beside or Path(tempfile.gettempdir())
    sweep(place)
    return tempfile.TemporaryDirectory(prefix=f"{'.' if beside else ''}{_own()}-", dir=place)


_SWEPT: set[Path] = set()


def sweep_once(folder: Path) -> None:
    """`sweep`, once per folder in this process."""
    if folder not in _SWEPT:
        _SWEPT.add(folder)
        sweep(folder)


def sweep(folder: Path) -> None:
    """Remove the temporary files and folders of dead processes directly in `folder`, if it exists.

    It touches nothing else, and follows no links. Files that cannot be removed stay.
    """
    folders = _FOLDER if folder == Path(tempfile.gettempdir()) else _HIDDEN
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if "rlg-" in entry.name:
                with contextlib.suppress(OSError):  # another process sweeps at the same time, or the file belongs to another user
                    is_folder = entry.is_dir(follow_symlinks=False)
                    name = (folders if is_folder else _FILE).fullmatch(entry.name)
                    if name and _is_dead(int(name[1]), name[2], entry):
                        _remove(entry)


def _is_dead(process: int, computer: str, entry: os.DirEntry[str]) -> bool:
    """Whether a leftover is dead. For this computer the process is looked up; a leftover of another computer must be old."""
    if computer == _computer() and _SIGNALS:
        return not _is_alive(process)
    return time.time() - entry.stat(follow_symlinks=False).st_mtime > _OLD


def _is_alive(process: int) -> bool:
    """Whether a process has that number. It may be a later process with the same number; the leftovers are then swept after its end."""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    with contextlib.suppress(OSError):  # an ended process keeps its number until its parent waits; in a container none may
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
    """Eight digits that identify the process numbers of this computer since its start, and of this container."""
    told = [platform.node()]
    with contextlib.suppress(OSError):  # these files exist only on Linux
        told = [Path("/proc/sys/kernel/random/boot_id").read_text(), str(os.stat("/proc/self/ns/pid").st_ino)]
    return hashlib.sha256("".join(told).encode()).hexdigest()[:8]
