"""A damaged kernel, or a kernel of another source, never runs. It is compiled again, once, and a line says so."""

import errno
import os
import pickle
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from numba import types

from benchmarks.reliability import mutations
from blender_rl_guiding import notices
from blender_rl_guiding.kernels import kept
from blender_rl_guiding.kernels.kept import Kept
from tests.patience import PATIENCE

INTEGER, NUMBER = (types.int64,), (types.float64,)


def double(x):
    return x + x


def halve(x):
    return x / 2


def compiled(function: Callable[..., Any], folder: Path, *signatures: Any) -> Any:
    kernel: Any = numba.njit(function)
    kernel._cache = Kept(folder, function)
    for signature in signatures:
        kernel.compile(signature)
    return kernel


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    lines: list[str] = []
    monkeypatch.setattr(kept, "tell", lines.append)
    return lines


def test_what_was_compiled_is_loaded(tmp_path: Path, told: list[str]):
    compiled(double, tmp_path, INTEGER, NUMBER)
    assert len(list(tmp_path.iterdir())) == 2
    again = compiled(double, tmp_path, INTEGER, NUMBER)
    assert (again(3), again(0.5)) == (6, 1.0)
    assert again.stats.cache_hits == {INTEGER: 1, NUMBER: 1}
    assert told == []


def test_damage_is_noticed_before_anything_of_it_is_run(tmp_path: Path, told: list[str], monkeypatch: pytest.MonkeyPatch):
    kernel = compiled(double, tmp_path, INTEGER)
    (path,) = tmp_path.iterdir()
    whole = path.read_bytes()
    assert kernel._cache.load_overload(INTEGER, kernel.targetctx) is not None
    monkeypatch.setattr(pickle, "loads", lambda _: pytest.fail("damage was unpickled"))
    for _, contents in mutations.of_bytes(whole, seed=1, count=70):
        told.clear()
        path.write_bytes(contents)
        assert kernel._cache.load_overload(INTEGER, kernel.targetctx) is None
        assert told == [f"the kernel {path} is damaged: it is compiled again"]


def test_what_is_damaged_is_compiled_again_and_replaced(tmp_path: Path, told: list[str]):
    compiled(double, tmp_path, INTEGER)
    (path,) = tmp_path.iterdir()
    whole = path.read_bytes()
    for contents in (whole[:100], whole[:-1], b"", whole[:40] + b"?" + whole[41:]):
        path.write_bytes(contents)
        assert compiled(double, tmp_path, INTEGER)(3) == 6
        assert compiled(double, tmp_path, INTEGER).stats.cache_hits == {INTEGER: 1}
    assert len(told) == 4


def test_one_kernel_in_the_place_of_another_is_not_run(tmp_path: Path, told: list[str]):
    compiled(double, tmp_path / "a", INTEGER, NUMBER)
    compiled(halve, tmp_path / "a", INTEGER)
    paths = sorted((tmp_path / "a").iterdir())
    contents = [path.read_bytes() for path in paths]
    for path, other in zip(paths, contents[1:] + contents[:1], strict=True):
        path.write_bytes(other)
    kernel = compiled(double, tmp_path / "a", INTEGER, NUMBER)
    assert (kernel(3), kernel(0.5), compiled(halve, tmp_path / "a", INTEGER)(4)) == (6, 1.0, 2.0)
    assert len(told) == 3


def test_a_full_disk_costs_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "replace", full)
    monkeypatch.setattr(notices, "_TOLD", set())
    heard: list[str] = []
    with notices.heard_by(heard.append):
        assert compiled(double, tmp_path, INTEGER, NUMBER)(0.5) == 1.0
    assert heard == [f"nothing is kept in {tmp_path} for the next time: No space left on device"]
    assert list(tmp_path.iterdir()) == []


STARTS = """
import sys
from pathlib import Path
import numba
from numba import types
from blender_rl_guiding.kernels.kept import Kept

kinds = [types.Array(kind, n, "C") for kind in (types.int64, types.float32) for n in (1, 2)]
kernel = numba.njit(lambda x: x.size * x.ndim)
kernel._cache = Kept(Path(sys.argv[1]), kernel.py_func)
print("ready", flush=True)
sys.stdin.readline()
for kind in kinds:
    kernel.compile((kind,))
print(sum(kernel.stats.cache_hits.values()), flush=True)
"""


def test_two_starts_at_once_leave_whole_files(tmp_path: Path):
    script, folder, pipe = tmp_path / "starts.py", tmp_path / "kernels", subprocess.PIPE
    script.write_text(STARTS)
    command = [sys.executable, str(script), str(folder)]
    children = [subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, cwd=Path(__file__).parents[2]) for _ in range(2)]
    for child in children:
        assert child.stdout
        assert child.stdout.readline() == "ready\n"
    for child in children:
        assert child.stdin
        child.stdin.write("\n")
        child.stdin.flush()
    assert [child.communicate(timeout=PATIENCE)[0].isdigit() or child.returncode for child in children] == [0, 0]
    assert len(list(folder.iterdir())) == 4
    for path in folder.iterdir():
        held = path.read_bytes()
        assert held[:32] == kept._digest(path.name, held[32:])
    third = subprocess.run(command, input="\n", capture_output=True, text=True, timeout=PATIENCE, cwd=Path(__file__).parents[2])
    assert (third.stdout, third.stderr) == ("ready\n4\n", "")


def test_folders_that_nobody_used_for_a_month_are_removed(tmp_path: Path):
    now = time.time()
    for age in (0, 29, 31, 400):
        folder = tmp_path / str(age)
        (folder / "below").mkdir(parents=True)
        (folder / "file").touch()
        os.utime(folder, (now - age * 86400,) * 2)
    (tmp_path / "own").mkdir()
    os.utime(tmp_path / "own", (0, 0))
    kept.sweep(tmp_path / "own")
    assert {path.name for path in tmp_path.iterdir()} == {"0", "29", "own"}
    assert np.isclose((tmp_path / "own").stat().st_mtime, now, atol=PATIENCE)
