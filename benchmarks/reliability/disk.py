"""A full disk when commands write: one line, status 2, no file half-written. With space again, results are those of a disk with space.

Root uses a small file system in memory. Other users use a limit on the size of files, RLIMIT_FSIZE: each write meets it, too.
"""

import os
import random
import resource
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from blender_rl_guiding.scene.bundle import load

from .commands import SMALL, called, difference, digest, leftovers, outcome_of
from .guard import Guard
from .ledger import ROOT, FoundError, Outcome
from .scenes import saved

SIZE = 48  # pixels, both ways
PAGE = 4096
COMMANDS: dict[str, tuple[object, ...]] = {
    "render": ("render", "--spp", 4, "--guide", "qtable", "--qtable.cells", 4, "--passes", "--denoise"),
    "compare": ("compare", "--methods", "bsdf,dqn", "--spp", 2, "--seeds", 1, "--reference-spp", 1, *SMALL),
    "report": ("report",),
    "export": ("export",),
}
TURNS = (*("render", "compare", "report") * 5, "export")  # export starts Blender, so it is rare


class Command:
    """A command, and its results on a disk with space."""

    def __init__(self, name: str, guard: Guard, folder: Path, prepare: Callable[[Path], None]) -> None:
        self._name, self._guard, self._prepare = name, guard, prepare
        first, *self._options = COMMANDS[name]
        self._first = str(first)
        whole = folder / f"whole-{name}"
        shutil.rmtree(whole, ignore_errors=True)
        self._check_status(self._run(whole), 0)
        self._clean = _digest(whole)
        files = [path.stat().st_size for path in whole.rglob("*") if path.is_file()]
        self.sizes, self.whole = sorted(set(files)), sum(-(-size // PAGE) * PAGE for size in files)

    def try_full(self, out: Path, rng: random.Random, mounted: bool) -> str:
        """Run it without enough space, and again with space. Returns "full", or "fitted" if the space sufficed."""
        if mounted:
            pages = rng.randrange(1, self.whole // PAGE + 8)
            with _mounted(out, pages * PAGE):
                return self._twice(out / "out", lambda: _remount(out, self.whole * 4 + (1 << 22)), lambda: None)
        limit = max(1, rng.choice(self.sizes) - rng.choice((1, 1, 100)))
        return self._twice(out / "out", lambda: _limit(resource.RLIM_INFINITY), lambda: _limit(limit))

    def _twice(self, out: Path, freed: Callable[[], None], filled: Callable[[], None]) -> str:
        if self._name == "report":
            try:
                self._prepare(out)
            except OSError:
                return "fitted not even what it reads"
        filled()
        try:
            status, said = self._run(out)
        finally:
            freed()
        result, error = outcome_of(status, said)
        if result == "refused" and (not error.startswith("rlg: ") or len(error) > 1000):
            raise FoundError(f"text: {said[-300:]!r}")
        if left := leftovers(out):
            raise FoundError(f"leftover: {left[0]} of {self._name}")
        try:
            _digest(out)
        except Exception as broken:  # any exception means that a file cannot be read
            raise FoundError(f"half: {self._name} has left a broken file, {broken}") from broken
        self._check_status(self._run(out), 0)
        if wrong := difference(_digest(out), self._clean):
            raise FoundError(f"difference: {self._name} with space again, {wrong}")
        return "full" if result == "refused" else "fitted"

    def _run(self, out: Path) -> tuple[int, str]:
        if self._name == "report":
            if not out.exists():
                self._prepare(out)
            return called("report", out)
        if self._name == "export":
            out.mkdir(exist_ok=True)
            return called("export", ROOT / "scenes" / "c1.blend", out / "c1.npz")
        return called(self._first, self._guard.root / "cornell.npz", *self._options, "--out", out)

    def _check_status(self, ended: tuple[int, str], expected: int) -> None:
        if ended[0] != expected:
            raise FoundError(f"status: {ended[0]} of {self._name} with space, {ended[1].strip()[-300:]}")


def outcomes(steps: range, seed: int, folder: Path, turns: tuple[str, ...] = TURNS) -> Iterator[Outcome]:
    """One outcome for each command on a full disk, in turns."""
    shutil.rmtree(folder, ignore_errors=True)
    guard = Guard(folder)
    saved(guard.root, SIZE)
    commands: dict[str, Command] = {}
    mounts = can_mount(guard.root / "mounted")

    def prepare(out: Path) -> None:
        """Fill a folder with finished runs, for a report."""
        if "compare" not in commands:
            commands["compare"] = Command("compare", guard, guard.root, prepare)
        shutil.copytree(guard.root / "whole-compare", out)
        for made in ("report.html", "table.csv", "table.tex"):
            (out / made).unlink(missing_ok=True)
        shutil.rmtree(out / "figures", ignore_errors=True)

    for step in steps:
        start, rng, finding, result = time.monotonic(), random.Random(f"{seed} {step}"), "", "broken"
        name = turns[step % len(turns)]
        with guard.here():
            try:
                command = commands.get(name) or commands.setdefault(name, Command(name, guard, guard.root, prepare))
                result = command.try_full(guard.folder(step), rng, mounts and step % 2 == 0)
            except FoundError as error:
                finding = str(error)
        yield Outcome(step, f"{name} {result}", finding=finding, seconds=time.monotonic() - start)


def can_mount(folder: Path) -> bool:
    """Whether this user may mount a file system."""
    folder.mkdir(parents=True, exist_ok=True)
    if os.geteuid() != 0 or subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", folder], capture_output=True).returncode:
        return False
    subprocess.run(["umount", folder], check=True)
    return True


@contextmanager
def _mounted(folder: Path, size: int) -> Iterator[None]:
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", folder], check=True)


def _remount(folder: Path, size: int) -> None:
    subprocess.run(["mount", "-o", f"remount,size={size}", folder], check=True)


def _limit(size: int) -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))


def _digest(folder: Path) -> dict[str, Any]:
    """`commands.digest`, with the keys of bundles."""
    return digest(folder) | {path.name: load(path).key for path in folder.glob("*.npz")}
