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

_OLD = 7 * 24 * 3600.0  # seconds after which what another computer, or this one before it was started anew, has left is taken for dead
_SIGNALS = os.name == "posix"  # elsewhere os.kill ends whatever it is sent to
# Names that `part_of` and `temporary_folder` give; the latter hides all but those where the system has its temporary files.
_FILE = re.compile(r"\..+\.rlg-(\d+)-([0-9a-f]{8})(\.[^.\n]*)?")
_FOLDER, _HIDDEN = (re.compile(dot + r"rlg-(\d+)-([0-9a-f]{8})-[a-z0-9_]{8}") for dot in ("", r"\."))


def part_of(path: Path) -> Path:
    """The temporary name beside `path` that this process writes to, with the same suffix: .STEM.rlg-PID-COMPUTER.SUFFIX."""
    return path.with_name(f".{path.stem}.{_own()}{path.suffix}")


def temporary_folder(beside: Path | None = None) -> "tempfile.TemporaryDirectory[str]":
    """A folder, hidden in `beside` or else where the system has temporary files; sweeps there first."""
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
    """Remove the temporary files and folders directly in `folder` whose processes are dead; there need be none, nor the folder.

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
    """Processes can be asked only of this computer; what is of another one has to be old."""
    if computer == _computer() and _SIGNALS:
        return not _is_alive(process)
    return time.time() - entry.stat(follow_symlinks=False).st_mtime > _OLD


def _is_alive(process: int) -> bool:
    """Whether there is a process of that number, be it another one by now: then its predecessor's are swept after that has ended."""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    with contextlib.suppress(OSError):  # one that has ended keeps its number until its parent asks, and in a container nobody may ask
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
    """Eight digits for those whose processes have numbers of one kind: this computer since it was started, and this container on it."""
    told = [platform.node()]
    with contextlib.suppress(OSError):  # only Linux has them
        told = [Path("/proc/sys/kernel/random/boot_id").read_text(), str(os.stat("/proc/self/ns/pid").st_ino)]
    return hashlib.sha256("".join(told).encode()).hexdigest()[:8]
