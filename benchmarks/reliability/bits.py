"""Every guide, encoder, and choice of their settings: the bits do not depend on threads, batches, jobs or kills."""

import hashlib
import json
import random
import shutil
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from blender_rl_guiding.render import render
from blender_rl_guiding.scene.bundle import load
from blender_rl_guiding.schema import to_dict
from blender_rl_guiding.settings import Machine, Render
from tests import unions

from . import scenes
from .commands import GOES_ON, Process, called, difference, digest
from .folders import compared
from .guard import Guard
from .kills import OFTEN
from .ledger import FoundError, Outcome, outcome_of_check

SIZE = 32  # pixels, both ways
THREADS, BATCHES, KILLS = (1, 2, 3), (77, 1000, 16384), 3
GUIDES = {unions.name(guide): guide for guide in unions.every_guide()}


def outcomes(steps: range, seed: int, folder: Path, size: int = SIZE, kills: int = KILLS) -> Iterator[Outcome]:
    """One outcome for each guide, in turns."""
    shutil.rmtree(folder, ignore_errors=True)
    guard = Guard(folder)
    bundle, names = scenes.saved(guard.root, size), list(GUIDES)
    for step in steps:
        rng, name = random.Random(f"{seed} {step}"), names[step % len(names)]
        check = partial(_check, bundle, Render(spp=8, seed=seed, guide=GUIDES[name]), guard, guard.folder(step), rng, kills)
        yield outcome_of_check(step, name, check)


def _check(bundle: Path, settings: Render, guard: Guard, folder: Path, rng: random.Random, kills: int) -> dict[str, float]:
    """The number of images compared."""
    with guard.here():
        compared = _of_threads(bundle, settings) + _of_jobs(bundle, settings, folder) + _of_kills(bundle, settings, guard, rng, kills)
    return {"renders": compared}


def figures(rows: list[dict[str, float]]) -> dict[str, float]:
    """The number of images compared."""
    return {"renders": float(sum(row["renders"] for row in rows))}


def _of_threads(bundle: Path, settings: Render) -> int:
    """Compare all numbers of threads and batches, in this process. Returns the number of renders."""
    scene, bits = load(bundle), {}
    for threads in THREADS:
        for batch in BATCHES:
            result = render(scene, settings, Machine(threads=threads, batch=batch))
            sums = b"".join(array.tobytes() for array in result.film.sums if array is not None)
            bits[threads, batch] = hashlib.sha256(sums).hexdigest(), result.rays, str(result.losses)
    if other := [place for place, found in bits.items() if found != bits[1, BATCHES[0]]]:
        raise FoundError(f"difference: {other[0][0]} threads and batches of {other[0][1]}")
    return len(bits)


def _of_jobs(bundle: Path, settings: Render, folder: Path) -> int:
    """Compare one run at a time with two. Returns the number of renders."""
    for jobs in (1, 2):
        if failed := compared(bundle, folder / f"jobs-{jobs}", jobs, methods={"method": settings}, seeds=2):
            raise FoundError(f"lost: {failed} of the runs failed, {jobs} at a time")
    if wrong := difference(*(digest(folder / f"jobs-{jobs}") for jobs in (1, 2))):
        raise FoundError(f"difference: two runs at a time, {wrong}")
    return 4


def _of_kills(bundle: Path, settings: Render, guard: Guard, rng: random.Random, kills: int) -> int:
    """Kill a render `kills` times, then let it end. Compare it with one never killed."""
    if not kills:
        return 0
    path = guard.work / "settings.json"
    path.write_text(json.dumps(to_dict(settings) | {"spp": 128}), encoding="utf-8")
    command = "render", bundle, "--settings", path, "--threads", 2
    whole, killed = guard.work / "whole", guard.work / "killed"
    for out in (whole, killed):
        shutil.rmtree(out, ignore_errors=True)
    start = time.monotonic()
    status, said = called(*command, "--out", whole)
    usual = time.monotonic() - start
    went_on = 0
    for _ in range(kills):
        with Process(guard, *command, *OFTEN, "--out", killed) as process:
            process.wait_for_another(killed / "checkpoint.npz")
            process.wait(rng.uniform(0, usual / 2))
            went_on += GOES_ON in process.said
    with Process(guard, *command, "--out", killed) as process:
        if status or process.wait():
            raise FoundError(f"status: not 0 after kills, {said or process.said}")
        went_on += GOES_ON in process.said
    if not went_on:
        raise FoundError(f"idle: {kills} kills, but no start went on from a checkpoint")
    if wrong := difference(digest(killed), digest(whole)):
        raise FoundError(f"difference: killed {kills} times, {wrong}")
    return 1
