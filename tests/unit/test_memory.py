"""The amount of free memory is read correctly on all kinds of machines and control groups."""

from pathlib import Path

import pytest

from blender_rl_guiding import memory

GB = 10**9
INFO = f"MemTotal: {64 * GB >> 10} kB\nMemAvailable: {32 * GB >> 10} kB\nSwapFree: {8 * GB >> 10} kB\n"


def two(most: int | str, taken: int, stat: str = "", swap: int | str | None = None) -> dict[str, str]:
    """A control group of version 2."""
    files = {"memory.max": str(most), "memory.current": str(taken), "memory.stat": stat}
    return files if swap is None else files | {"memory.swap.max": str(swap), "memory.swap.current": "0"}


def one(most: int, taken: int, stat: str = "", both: int | None = None) -> dict[str, str]:
    """A control group of version 1. `both` limits memory plus swap."""
    files = {"memory.limit_in_bytes": str(most), "memory.usage_in_bytes": str(taken), "memory.stat": stat}
    return files if both is None else files | {"memory.memsw.limit_in_bytes": str(both), "memory.memsw.usage_in_bytes": str(taken)}


NO_LIMIT = 9223372036854771712  # version 1 writes this for "no limit"
STAT = f"anon 0\nfile {3 * GB}\nshmem {2 * GB}\ninactive_anon {2 * GB}\ninactive_file {GB}\nactive_file 0\nslab_reclaimable {GB}\n"
STAT_1 = f"cache {3 * GB}\ntotal_cache {3 * GB}\ntotal_shmem {2 * GB}\ninactive_file 5\ntotal_inactive_file {GB}\ntotal_active_file 0\n"
# (lines of /proc/self/cgroup, control groups by folder, GB free, GB available).
MACHINES = {
    "no groups": ("", {}, 32, 40),
    "no limit": ("0::/\n", {}, 32, 40),
    "max": ("0::/a\n", {"a": two("max", 5)}, 32, 40),
    "container": ("0::/\n", {"": two(4 * GB, GB)}, 3, 11),
    "container without swap": ("0::/\n", {"": two(4 * GB, GB, swap=0)}, 3, 3),
    "some swap": ("0::/\n", {"": two(4 * GB, GB, swap=2 * GB)}, 3, 5),
    "files in memory are not free": ("0::/\n", {"": two(4 * GB, 3 * GB, STAT)}, 3, 11),
    "scope": ("0::/user/scope\n", {"user": two("max", 0), "user/scope": two(2 * GB, GB)}, 1, 9),
    "slice around": ("0::/user/scope\n", {"user": two(2 * GB, GB, swap=GB), "user/scope": two(9 * GB, GB)}, 1, 2),
    "memory inside, swap around": ("0::/user/scope\n", {"user": two("max", 0, swap=0), "user/scope": two(9 * GB, GB)}, 8, 8),
    "overdrawn": ("0::/\n", {"": two(4 * GB, 5 * GB)}, 0, 8),
    "path of another namespace": ("0::/../../b\n", {"": two(4 * GB, GB)}, 3, 11),
    "1": ("4:memory:/slurm/job\n0::/\n", {"memory/slurm/job": one(4 * GB, GB)}, 3, 11),
    "1 without limit": ("4:memory:/slurm\n", {"memory/slurm": one(NO_LIMIT, GB, both=NO_LIMIT)}, 32, 40),
    "1 around": ("4:memory:/slurm/job\n", {"memory/slurm": one(4 * GB, GB), "memory/slurm/job": one(NO_LIMIT, GB)}, 3, 11),
    "1 with files": ("4:memory:/\n", {"memory": one(4 * GB, 3 * GB, STAT_1)}, 2, 10),
    "1 with swap": ("4:memory:/\n", {"memory": one(4 * GB, GB, both=6 * GB)}, 3, 5),
    "1 without swap": ("4:memory:/\n", {"memory": one(4 * GB, GB, both=4 * GB)}, 3, 3),
    "docker, path of the host": ("4:memory:/docker/1f\n", {"memory": one(4 * GB, GB)}, 3, 11),
    "damaged file": (
        "4:memory:/\n0::/\n",
        {"memory": one(4 * GB, GB) | {"memory.stat": "total_inactive_file\n"}, "": {"memory.max": "?"}},
        3,
        11,
    ),
}


@pytest.fixture
def machine(tmp_path: Path, monkeypatch) -> Path:
    monkeypatch.setattr(memory, "_PROC", tmp_path / "proc")
    monkeypatch.setattr(memory, "_GROUPS", tmp_path / "groups")
    (tmp_path / "proc" / "self").mkdir(parents=True)
    (tmp_path / "proc" / "meminfo").write_text(INFO)
    return tmp_path


@pytest.mark.parametrize("name", MACHINES)
def test_the_least_limit_counts(machine: Path, name):
    lines, groups, free, available = MACHINES[name]
    (machine / "proc" / "self" / "cgroup").write_text(lines)
    for folder, files in groups.items():
        (machine / "groups" / folder).mkdir(parents=True, exist_ok=True)
        for file, text in files.items():
            (machine / "groups" / folder / file).write_text(text)
    assert memory.free() == pytest.approx(free * GB, abs=4096)
    assert memory.available() == pytest.approx(available * GB, abs=4096)


def test_where_nothing_tells_it_is_all_that_is_there(machine: Path):
    (machine / "proc" / "meminfo").write_text("MemTotal: 5 kB\n")
    assert memory.free() == memory.available() > GB


def test_this_machine_tells():
    assert 0 < memory.free() <= memory.available()
