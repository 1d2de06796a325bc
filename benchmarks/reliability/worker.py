"""A worker that runs for an hour must not grow. It gets jobs of all kinds, damaged ones, and neighbours that are killed."""

import json
import math
import os
import random
import shutil
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from statistics import NormalDist

import numpy as np

from . import mutations, scenes
from .guard import Guard
from .ledger import FoundError, Outcome
from .lines import Talk, jobs, started

SIZE = 24  # pixels, both ways
WARM = 0.2  # first share of the measures, left out of the fit: everything is still new to the worker
MEASURES = {"memory": "MiB", "files": "open", "threads": "", "temporary": "files"}
FOUND = {"memory": 8.0, "files": 0.5, "threads": 0.5, "temporary": 0.5}  # growth in an hour: a finding if its whole interval is above


def outcomes(steps: range, seed: int, folder: Path, minute: float = 60.0, least: int = 1) -> Iterator[Outcome]:
    """One outcome a minute, or after `least` jobs if they take longer. Its numbers are the last measures."""
    shutil.rmtree(folder, ignore_errors=True)
    guard = Guard(folder)
    bundle = scenes.saved(guard.root, SIZE)
    with guard.here():
        talk = started(guard.work, bundle)
    rng, start = random.Random(f"{seed} {steps.start}"), time.monotonic()
    try:
        for step in steps:
            finding, done, rows = "", 0, []
            while time.monotonic() < start + minute * (step - steps.start + 1) or len(rows) < least:
                try:
                    done += _one(talk, rng, bundle, guard)
                except FoundError as error:
                    finding = str(error)
                    talk.end()
                    with guard.here():
                        talk = Talk(guard.work)
                rows.append(measured(talk.pid, guard))
            yield Outcome(
                step, "minute", finding=finding, seconds=minute, numbers={"jobs": done, "all": len(rows), "process": talk.pid} | rows[-1]
            )
    finally:
        talk.end()


def _one(talk: Talk, rng: random.Random, bundle: Path, guard: Guard) -> int:
    """Send a job and wait for its answer. Returns 1 if it was done.

    1 of 5 jobs is damaged. During 1 of 10 images are deleted. Before 1 of 30 a neighbour is killed that renders into the same folder.
    """
    frames = guard.work / "frames"
    job = rng.choice(jobs(bundle, guard.work)[:4])
    if rng.random() < 1 / 30:
        _kill_neighbour(rng, bundle, guard)
    if rng.random() < 0.2:
        line = mutations.text(mutations.damaged(job, rng, ("", "x", "none.npz", "\x00", "\ud800")), rng)
        talk.send(line.encode("utf-8", "surrogatepass").replace(b"\n", b" "))
    else:
        talk.send(json.dumps(job).encode())
    if rng.random() < 0.1:
        time.sleep(rng.random() * 0.2)
        shutil.rmtree(frames, ignore_errors=True)
    talk.send(b'{"job": "render", "bundle": "next.npz", "settings": {}}')
    return any(event["event"] == "done" for event in talk.until("next.npz"))


def _kill_neighbour(rng: random.Random, bundle: Path, guard: Guard) -> None:
    with guard.here():
        other = Talk(guard.work)
    other.send(json.dumps(jobs(bundle, guard.work)[1]).encode())
    time.sleep(rng.uniform(0.0, 4.0))
    other.end()


def measured(pid: int, guard: Guard) -> dict[str, float]:
    """Resident memory of a process in MiB, its open files and threads, and temporary files that were left."""
    own = Path(f"/proc/{pid}")
    with suppress(OSError):
        pages = int((own / "statm").read_text().split()[1])
        left = sum(path.name.startswith(".") and path.name != ".lock" for path in guard.work.rglob("*")) + len(os.listdir(guard.tmp))
        sizes = {"files": len(os.listdir(own / "fd")), "threads": len(os.listdir(own / "task")), "temporary": left}
        return {"memory": pages * os.sysconf("SC_PAGE_SIZE") / (1 << 20)} | sizes
    return {}


def figures(rows: list[dict[str, float]]) -> dict[str, float | str]:
    """The number of jobs done, the last measures, and the growth of each in an hour."""
    told: dict[str, float | str] = {"jobs": float(sum(row["jobs"] for row in rows))}
    for name, (last, slope, margin) in growth(rows).items():
        told |= {name: last, f"{name} in an hour": f"{slope:+.2f} +- {margin:.2f}"}
    return told


def verdict(rows: list[dict[str, float]]) -> str:
    """A finding that names the measures that grow, or ""."""
    grows = [
        f"{name} by {slope:.2f} +- {margin:.2f} {MEASURES[name]} in an hour"
        for name, (_, slope, margin) in growth(rows).items()
        if slope - margin > FOUND[name]
    ]
    return f"growth: {', '.join(grows)}" if grows else ""


def growth(rows: list[dict[str, float]]) -> dict[str, tuple[float, float, float]]:
    """(last value, growth in an hour, half its 95 % interval) of each measure, from a line through all but the first fifth.

    Only the rows of the last process count: after a crash or Ctrl-C another begins anew.
    """
    own = [row for row in rows if row.get("process") == rows[-1].get("process") and "memory" in row]
    late = own[round(WARM * len(own)) :]
    if len(late) < 4:
        return {}
    hours = np.array([row["step"] for row in late]) / 60
    return {name: (float(late[-1][name]), *fitted(hours, np.array([row[name] for row in late]))) for name in MEASURES}


def fitted(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """(slope of the line through points, half its 95 % interval), from the variance of residuals and the normal quantile."""
    centred = x - x.mean()
    spread = float(centred @ centred)
    slope = float(centred @ (y - y.mean())) / spread
    residuals = y - y.mean() - slope * centred
    return slope, NormalDist().inv_cdf(0.975) * math.sqrt(float(residuals @ residuals) / (len(x) - 2) / spread)
