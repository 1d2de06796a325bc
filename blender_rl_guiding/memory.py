"""The memory that this process can still get, and the parts of its need. Standard library only, because the add-on reads bundles, too."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

# Minimal measured / estimated memory: of a part that follows from sizes, and of a part that depends on the paths, such as a guide's cells.
MEASURED, GUESSED = 0.75, 0.4
_UNLIMITED = 1 << 62  # bytes
_PROC = Path("/proc")
_GROUPS = Path("/sys/fs/cgroup")


class Part(NamedTuple):
    """One part of the memory that a render takes."""

    name: str
    bytes: float
    lower: str  # the setting that reduces it
    sure: float = MEASURED  # share of `bytes` that is certainly taken


class _Left(NamedTuple):
    """Bytes that the machine or a control group has left."""

    memory: int = _UNLIMITED
    swap: int = _UNLIMITED
    both: int = _UNLIMITED


def free() -> int:
    """Bytes that this process can take without swapping, within the limits of all its control groups."""
    return min(left.memory for left in _lefts())


def available() -> int:
    """The maximal bytes that this process can take: `free` plus swap. More is sure to fail."""
    memory, swap, both = map(min, zip(*_lefts(), strict=True))
    return min(memory + swap, both)


def _lefts() -> list[_Left]:
    return [_of_machine(), *_of_groups()]


def _of_machine() -> _Left:
    try:
        rows = dict(line.split(":") for line in (_PROC / "meminfo").read_text(encoding="ascii").splitlines())
        memory, swap = (int(rows[name].split()[0]) * 1024 for name in ("MemAvailable", "SwapFree"))
    except (OSError, ValueError, LookupError):
        known = "SC_PHYS_PAGES" in os.sysconf_names
        return _Left(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") if known else _UNLIMITED, 0)
    return _Left(memory, swap)


def _of_groups() -> Iterator[_Left]:
    """The free memory in each control group of this process, of both versions, from the innermost to the outermost."""
    try:
        lines = (_PROC / "self" / "cgroup").read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):  # another system
        return
    for _, controllers, path in (line.split(":", 2) for line in lines):
        if controllers in ("", "memory"):
            root, left = (_GROUPS / "memory", _of_version_1) if controllers else (_GROUPS, _of_version_2)
            own = root / path.removeprefix("/")  # in a container this host path may not exist; the root is then its own group
            yield from (left(folder) for folder in (own, *own.parents) if folder.is_relative_to(root))


def _of_version_1(group: Path) -> _Left:
    given_back = _given_back(group, "total_inactive_file", "total_active_file")
    memory = _difference(group, "memory.limit_in_bytes", "memory.usage_in_bytes")
    both = _difference(group, "memory.memsw.limit_in_bytes", "memory.memsw.usage_in_bytes")
    return _Left(memory=max(0, memory + given_back), both=max(0, both + given_back))


def _of_version_2(group: Path) -> _Left:
    given_back = _given_back(group, "inactive_file", "active_file", "slab_reclaimable")
    memory = _difference(group, "memory.max", "memory.current")
    return _Left(memory=max(0, memory + given_back), swap=max(0, _difference(group, "memory.swap.max", "memory.swap.current")))


def _given_back(group: Path, *names: str) -> int:
    """Bytes that the kernel reclaims on demand: pages of files, except files in memory (/dev/shm)."""
    try:
        rows = [line.split() for line in (group / "memory.stat").read_text(encoding="ascii").splitlines()]
        return sum(int(count) for name, count in rows if name in names)
    except (OSError, ValueError):
        return 0


def _difference(group: Path, most: str, taken: str) -> int:
    """The number in one file of a group minus the number in another. Unlimited if a file is missing or contains "max"."""
    try:
        return int((group / most).read_text(encoding="ascii")) - int((group / taken).read_text(encoding="ascii"))
    except (OSError, ValueError):
        return _UNLIMITED


def in_words(count: float) -> str:
    """A number of bytes for people: "3.2 GB"."""
    for unit in ("bytes", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.0f} {unit}" if unit == "bytes" or count >= 100 else f"{count:.2g} {unit}"
        count /= 1000
    return f"{count:.2f} TB"
