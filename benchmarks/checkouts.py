"""Renders by two checkouts, each through its own command `rlg`, and compares the outcomes."""

import json
import shutil
import subprocess
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import OpenEXR

from blender_rl_guiding.children import fate
from blender_rl_guiding.errors import InputError

from .reliability.commands import TIMES
from .reliability.ledger import ROOT

SIDES = "this", "other"
MOST_NAMED = 4  # of the parts that differ


class Pair:
    """This checkout and the other one, and a folder for what they write: SIDE.npz, SIDE/image.exr and so on."""

    def __init__(self, other: Path, folder: Path) -> None:
        self.homes: dict[str, Path] = {"this": ROOT, "other": other.resolve()}
        self.folder = folder
        if self.homes["other"] == ROOT:
            raise InputError(f"{other} is this checkout")
        for home in self.homes.values():
            check_set_up(home)

    def render(self, side: str, *flags: str) -> str:
        """Render the bundle of this checkout; what went wrong, or empty."""
        shutil.rmtree(self.folder / side, ignore_errors=True)
        return self.rlg(side, "render", self.folder / "this.npz", "--out", self.folder / side, "--checkpoint", "0", *flags)

    def export(self, side: str, scene: Path, *view: str) -> str:
        """Write SIDE.npz; what went wrong, or empty."""
        bundle = self.folder / f"{side}.npz"
        bundle.unlink(missing_ok=True)
        return self.rlg(side, "export", scene, bundle, *view)

    def rlg(self, side: str, *arguments: object) -> str:
        """Run a checkout's command; what went wrong, or empty."""
        done = self.ran(side, *arguments)
        return f"{side}: {fate(done.returncode, done.stderr.strip())}" if done.returncode else ""

    def ran(self, side: str, *arguments: object) -> "subprocess.CompletedProcess[str]":
        """Run a checkout's command."""
        command = [str(self.homes[side] / ".venv" / "bin" / "rlg"), *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL)


def check_set_up(home: Path) -> None:
    """InputError unless a checkout's command runs its own modules: a .venv that was copied runs those of another one."""
    if not (home / ".venv" / "bin" / "rlg").is_file():
        raise InputError(f"{home} has no .venv/bin/rlg: `./build.sh setup` makes it there")
    paths = [line.strip() for file in home.glob(".venv/lib/python*/site-packages/*.pth") for line in file.read_text().splitlines()]
    if not any(path.startswith("/") and Path(path).resolve() == home for path in paths):
        raise InputError(f"{home}/.venv runs the modules of another folder: `./build.sh setup` makes it anew there")


def of_both(task: Callable[[str], str]) -> str:
    """Do a task for both sides at the same time; what went wrong, or empty."""
    with ThreadPoolExecutor(len(SIDES)) as pool:
        return "; ".join(filter(None, pool.map(task, SIDES)))


def contents(folder: Path) -> dict[str, Any]:
    """The outcome of a render: rays, losses, the curve without its times, and the bits of each channel of each EXR file."""
    record = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    curve = [{name: value for name, value in entry.items() if name not in TIMES} for entry in record["curve"]]
    found: dict[str, Any] = {"rays": record["rays"], "losses": record["losses"], "curve": curve}
    for path in sorted(folder.glob("*.exr")):
        with OpenEXR.File(str(path), separate_channels=True) as file:
            channels = {name: channel.pixels for part in file.parts for name, channel in part.channels.items()}
        found |= {f"{path.name} {name}": (str(p.dtype), p.shape, p.tobytes()) for name, p in channels.items()}
    return found


def unlike(ours: dict[str, Any], theirs: dict[str, Any]) -> str:
    """Names of what is not the same; empty if all is."""
    names = [name for name in {**ours, **theirs} if ours.get(name) != theirs.get(name)]
    rest = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return ", ".join(names[:MOST_NAMED]) + rest
