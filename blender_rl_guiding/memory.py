"""How much memory this process can still have. Standard library only: the add-on reads bundles, too."""

import os
from pathlib import Path

UNKNOWN = 1 << 62  # bytes, where nothing tells: no limit
_GROUP = Path("/sys/fs/cgroup")  # of a container; the process's own group, where there is a tree of them, is not looked for


def available() -> int:
    """Bytes that can be taken without anything being swapped out, and within the container's limit."""
    return min(_of_machine(), _of_group())


def _of_machine() -> int:
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:"))
    except (OSError, ValueError, StopIteration):
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") if "SC_PHYS_PAGES" in os.sysconf_names else UNKNOWN


def _of_group() -> int:
    """What a control group of version 2 leaves; the files that it has read count as free."""
    try:
        most = int((_GROUP / "memory.max").read_text(encoding="ascii"))
        taken = int((_GROUP / "memory.current").read_text(encoding="ascii"))
        cached = next(
            int(line.split()[1]) for line in (_GROUP / "memory.stat").read_text(encoding="ascii").splitlines() if line.startswith("file ")
        )
    except (OSError, ValueError, StopIteration):  # there is none, or it has no limit: "max"
        return UNKNOWN
    return max(0, most - taken + cached)


def in_words(count: float) -> str:
    """A number of bytes for people: "3.2 GB"."""
    for unit in ("bytes", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.0f} {unit}" if unit == "bytes" or count >= 100 else f"{count:.2g} {unit}"
        count /= 1000
    return f"{count:.2f} TB"
