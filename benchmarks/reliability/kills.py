"""Commands that are killed at random moments and started again: finished runs are kept, and the bits are those of one run."""

import os
import random
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from blender_rl_guiding.images import read_exr

from . import scenes
from .commands import GOES_ON, SMALL, Process, called, difference, digest, leftovers
from .guard import Guard
from .ledger import FoundError, Outcome

SIZE = 32  # pixels, both ways
LATEST = 1.3  # latest kill as a share of the usual time: some end before
LATE = 0.8  # share of a render's kills that wait for its checkpoint
OFTEN = ("--checkpoint", 0.001)  # before each pass

_COMPARE = ("--methods", "bsdf,qtable,dqn", "--spp", 6, "--seeds", 2, "--reference-spp", 256, "--qtable.cells", 4, *SMALL)
_RENDER = ("--spp", 256, "--threads", 2)
COMMANDS: dict[str, tuple[object, ...]] = {  # the command, and its options behind the scene
    "compare": ("compare", *_COMPARE),
    "render a table": ("render", *_RENDER, "--guide", "qtable", "--qtable.cells", 8),
    "sweep": ("sweep", "--spp", 2, "--seeds", 2, "--reference-spp", 128, "--jobs", 2),
    "render a network": ("render", *_RENDER, "--guide", "dqn", *SMALL),
}


def words(name: str, bundle: Path) -> tuple[object, ...]:
    """A command on the scene of a bundle, without its folder."""
    first, *options = COMMANDS[name]
    scene = ("slides-resolution", "--scenes", bundle.parent) if first == "sweep" else (bundle,)
    return (first, *scene, *options)


class Victim:
    """A command, its results if never killed, and a folder where it is killed again and again."""

    def __init__(self, name: str, folder: Path, size: int = SIZE) -> None:
        shutil.rmtree(folder, ignore_errors=True)
        self.name, self._guard = name, Guard(folder)
        command = words(name, scenes.saved(self._guard.root, size, "a1"))
        self._command = (*command, *OFTEN) if command[0] == "render" else command
        self._out, self.went_on = self._guard.work / "killed", 0  # starts from a checkpoint
        self.usual, self._rendering, self._clean = self._undisturbed()
        self._anew()

    def attempt(self, rng: random.Random) -> bool:
        """Start it and kill it. Returns False if it ended before; then its results are checked. FoundError if something is wrong."""
        late, group = self._command[0] == "render" and rng.random() < LATE, rng.random() < 0.5
        moment = rng.uniform(0, LATEST * (self._rendering if late else self.usual))
        with Process(self._guard, *self._command, "--out", self._out) as process:
            if late:
                process.wait_for_another(self._out / "checkpoint.npz")
            status = process.wait(moment)
            if status is not None:
                self._check_end(status, process.said)
                return False
            process.kill(group)
            if not group and (left := process.orphans()):
                raise FoundError(f"orphan: {len(left)} processes outlive {self.name}, which was killed")
            self._check_unchanged(process.said)
        return True

    def finish(self) -> None:
        """Let it end, and check its results."""
        with Process(self._guard, *self._command, "--out", self._out) as process:
            self._check_end(process.wait(), process.said)

    def _undisturbed(self) -> tuple[float, float, dict[str, Any]]:
        """(its seconds, those after a render's first checkpoint, its results). All kernels are compiled before."""
        with self._guard.here():
            status, said = called(*self._command, "--out", self._guard.work / "warm")
        if status:
            raise FoundError(f"status: {status} of {self.name} undisturbed, {said}")
        self._forget_references()
        start, whole = time.monotonic(), self._guard.work / "whole"
        with Process(self._guard, *self._command, "--out", whole) as process:
            if self._command[0] == "render":
                process.wait_for_another(whole / "checkpoint.npz")
            middle = time.monotonic()
            if process.wait():
                raise FoundError(f"status: {self.name} undisturbed, {process.said}")
        return time.monotonic() - start, time.monotonic() - middle, digest(whole)

    def _anew(self) -> None:
        self._forget_references()
        shutil.rmtree(self._out, ignore_errors=True)
        self._finished: dict[str, Any] = {}
        self._checkpoint = False

    def _forget_references(self) -> None:
        shutil.rmtree(self._guard.cache / "blender_rl_guiding" / "references", ignore_errors=True)

    def _check_unchanged(self, said: str) -> None:
        """Runs that were finished before the start are unchanged. Notes those that are finished now."""
        self._check_resumed(said)
        now = {}
        results = [] if self._command[0] == "render" else self._out.rglob("result.json")  # `render` renders again whenever asked to
        for result in results:
            image = result.with_name("image.exr")
            read_exr(image)
            now[str(image)] = (image.stat().st_mtime_ns, image.stat().st_ino)
        for name, known in self._finished.items():
            if now.get(name) != known:
                raise FoundError(f"lost: {name} was finished before the kill, and is {'done again' if name in now else 'gone'}")
        self._finished = now
        self._checkpoint = (self._out / "checkpoint.npz").exists()

    def _check_resumed(self, said: str) -> None:
        if "Traceback" in said:
            raise FoundError(f"traceback: {said.strip().splitlines()[-1]}")
        self.went_on += GOES_ON in said
        if self._checkpoint and said and GOES_ON not in said:
            raise FoundError(f"lost: there was a checkpoint, but {self.name} did not go on from it: {said.strip()}")

    def _check_end(self, status: int | None, said: str) -> None:
        if status != 0:
            raise FoundError(f"status: {status} of {self.name} after a kill, {(said.strip().splitlines() or [''])[-1]}")
        self._check_unchanged(said)
        if wrong := difference(digest(self._out), self._clean):
            raise FoundError(f"difference: {self.name}, {wrong}")
        places = self._out, self._guard.cache
        if left := [*leftovers(*places), *os.listdir(self._guard.tmp)]:
            raise FoundError(f"leftover: {self.name}, {len(left)} files, {left[0]}")
        self._anew()

    def begin_again(self) -> None:
        """Clear the folder after a finding, so that each is found once."""
        shutil.rmtree(self._guard.tmp)
        self._guard.tmp.mkdir()
        for left in self._guard.cache.rglob(".*"):
            left.unlink()
        self._anew()


def outcomes(steps: range, seed: int, folder: Path, names: tuple[str, ...] = tuple(COMMANDS), size: int = SIZE) -> Iterator[Outcome]:
    """One outcome for each kill; commands take turns. The last steps let each command end."""
    victims: dict[str, Victim] = {}
    for step in steps:
        start, rng, name = time.monotonic(), random.Random(f"{seed} {step}"), names[step % len(names)]
        before = victims[name].went_on if name in victims else 0
        try:
            victim = victims.get(name) or victims.setdefault(name, Victim(name, folder / name.replace(" ", "-"), size))
            ended = 0
            while not victim.attempt(rng):
                ended += 1
            finding = ""
            if step >= steps.stop - len(names):
                victim.finish()
                ended += 1
        except FoundError as error:
            finding, ended = str(error), 0
            if name in victims:
                victims[name].begin_again()
        went_on = victims[name].went_on - before if name in victims else 0
        numbers: dict[str, float] = {"ended": ended, "went on": went_on, "renders": COMMANDS[name][0] == "render"}
        yield Outcome(step, name, finding=finding, seconds=time.monotonic() - start, numbers=numbers)


def figures(rows: list[dict[str, float]]) -> dict[str, float]:
    """Numbers of: commands that ended and were compared, kills of renders, starts from a checkpoint."""
    names = {"ended": "compared", "renders": "kills of renders", "went on": "went on from a checkpoint"}
    return {told: float(sum(row.get(name, 0) for row in rows)) for name, told in names.items()}


def verdict(rows: list[dict[str, float]]) -> str:
    """A finding if too few killed renders started from a checkpoint: then the campaign has tried nothing."""
    told = figures(rows)
    killed, went_on = told["kills of renders"], told["went on from a checkpoint"]
    return (
        f"idle: {killed:.0f} kills of renders, but only {went_on:.0f} starts went on from a checkpoint" if went_on < killed / 2 - 2 else ""
    )
