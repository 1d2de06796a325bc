"""Damaged folders of results: report, hand-over and resume accept them or fail with one line, and write nothing outside."""

import json
import random
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from blender_rl_guiding import report
from blender_rl_guiding.comparison import Comparison
from blender_rl_guiding.experiments.runner import Experiment, run
from blender_rl_guiding.report import handover
from blender_rl_guiding.scene.bundle import load
from blender_rl_guiding.settings import DQN, Machine, QTable, Render

from . import mutations, scenes
from .commands import difference, digest
from .guard import Guard
from .ledger import FoundError

SIZE = 12  # pixels, both ways
_LEARNING = DQN(layers=2, width=8, rows=3, columns=4, cells=4, learning_starts=64, batch=64, first_steps=4, steps=2)
METHODS = {"bsdf": Render(spp=2), "qtable": Render(spp=2, guide=QTable(cells=4, recorded=500)), "dqn": Render(spp=2, guide=_LEARNING)}


@contextmanager
def silent(description: str, total: float) -> Iterator[Callable[..., None]]:
    """Progress that nobody sees."""
    yield lambda done, **anew: None


def experiment(bundle: Path, folder: Path, methods: dict[str, Render] = METHODS, seeds: int = 1) -> Experiment:
    """A comparison on the scene of a bundle."""
    asked = Comparison(tuple(methods.items()), budget="EACH", seeds=seeds, reference_spp=1)
    return Experiment(folder, (load(bundle),), asked, "rlg compare")


def compared(bundle: Path, folder: Path, jobs: int = 1, **values: Any) -> int:
    """Do the missing runs of a comparison. Returns the number of runs that failed."""
    return run([experiment(bundle, folder, **values)], Machine(threads=2), jobs, silent)


def reported(folder: Path) -> dict[str, Any]:
    """Write the report. Returns the hand-over to the add-on."""
    return handover.handed_over(report.write(folder))


class Fuzz:
    """See `trying.Trial`."""

    def __init__(self, guard: Guard) -> None:
        self._guard, self._texts = guard, (*mutations.TEXTS, *guard.ways_out)
        self._bundle = scenes.saved(guard.tmp, SIZE)
        self._clean = guard.tmp / "clean"
        compared(self._bundle, self._clean)
        reported(self._clean)
        self._digest = digest(self._clean)

    def attempt(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        copy = folder / "results"
        shutil.copytree(self._clean, copy)
        said = [self._damage(copy, rng) for _ in range(rng.choice((1, 1, 2, 3)))] if rng.random() < 0.9 else [_lead_out(copy, rng)]
        (folder / "damage.txt").write_text("\n".join(said), encoding="utf-8")
        self._guard.place = copy
        try:
            if rng.random() < 0.25:
                return self._resumed(copy, said)
            json.dumps(reported(copy))
        finally:
            self._guard.place = self._guard.work
        return "accepted", ""

    def _resumed(self, copy: Path, damage: list[str]) -> tuple[str, str]:
        """Resume the comparison in a damaged folder. It ends in the numbers of the sound one.

        No command removes a folder in the place of a file: there the run fails with a line.
        """
        failed = compared(self._bundle, copy)
        if failed and any(said.endswith(": folder") for said in damage):
            return "refused", ""
        if failed:
            raise FoundError(f"lost: {failed} runs failed")
        reported(copy)
        runs = {name: value for name, value in self._digest.items() if not name.endswith(".png")}
        there = {name: value for name, value in digest(copy).items() if name in runs}
        if wrong := difference(there, runs):
            raise FoundError(f"difference: {wrong}")
        return "resumed", ""

    def _damage(self, copy: Path, rng: random.Random) -> str:
        """Damage a file: other values or bytes, no file, a link, a folder, or another file. Returns what was done."""
        there = sorted(path for path in copy.rglob("*") if path.is_file() and not path.is_symlink())
        read = [path for path in there if path.suffix in (".json", ".exr")]
        path = rng.choice(read if rng.random() < 0.8 else there)
        how = rng.choice(("values", "values", "values", "values", "bytes", "gone", "link", "loop", "other", "folder", "folder link"))
        if how == "values" and path.suffix == ".json":
            try:
                values = json.loads(path.read_text(encoding="utf-8"))
            except ValueError:
                values = {}
            path.write_text(mutations.text(mutations.damaged(values, rng, self._texts), rng), encoding="utf-8", errors="surrogatepass")
        elif how in ("values", "bytes"):
            path.write_bytes(mutations.damaged_bytes(path.read_bytes(), rng))
        elif how == "other":
            path.write_bytes(rng.choice(read).read_bytes())
        elif how == "folder link" and path.parent != copy:
            shutil.rmtree(path.parent)
            path.parent.symlink_to(self._guard.root / "canary")
        else:
            path.unlink()
            if how == "link":
                path.symlink_to(self._guard.root / "canary.txt")
            elif how == "loop":
                path.symlink_to(path.name)
            elif how == "folder":
                path.mkdir()
        return f"{path.relative_to(copy)}: {how}"


def _lead_out(copy: Path, rng: random.Random) -> str:
    """Give the scene or a method a name that leads out of the folder and out of `figures`, and make the target. Returns what was done."""
    path = copy / "experiment.json"
    plan = json.loads(path.read_text(encoding="utf-8"))
    kind, (scene, *_) = rng.choice(("scenes", "methods")), plan["scenes"]
    old = plan[kind][0]
    where = copy if kind == "scenes" else copy / scene
    up = "../" * rng.choice((1, 2) if kind == "scenes" else (1, 2, 3))  # the targets are where the campaign may write
    name = rng.choice((f"a/../{up}x", f"{up}x", str(copy.parent / "x")))
    (where / "a").mkdir()
    shutil.copytree(where / old, where / name, dirs_exist_ok=True)
    for figure in list((copy / "figures").glob(f"*{old}*")):
        (figure.parent / f"{figure.stem.replace(old, '')}a").mkdir(exist_ok=True)
    plan[kind][0] = name
    plan["baseline"] = name if plan["baseline"] == old else plan["baseline"]
    path.write_text(json.dumps(plan), encoding="utf-8")
    return f"{kind} {name}"
