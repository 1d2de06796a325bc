"""The runs of an experiment, what is missing, means and intervals, and the flat table of it all."""

import csv
import io
import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

MEASURES = ("mape_display", "mape", "relmse", "flip")
COLUMNS = ("scene", "method", "seed", "spp", "seconds", "learn_seconds", "train_seconds", "infer_seconds", "rays", *MEASURES)
# 97.5 % quantiles of Student's t for 1..9 degrees of freedom; from 10 on, the series in `_student` has four digits.
_T = (12.7062, 4.30265, 3.18245, 2.77645, 2.57058, 2.44691, 2.36462, 2.30600, 2.26216)


class Learnt(NamedTuple):
    """What a run has learnt of the light at the point that a pixel sees."""

    pixel: tuple[int, int]  # column and row, from the top left
    q: np.ndarray  # (rows, columns), mean radiance through each patch of the hemisphere, row 0 at the horizon


class Truth(NamedTuple):
    """The light that arrives at the point that a pixel sees."""

    pixel: tuple[int, int]
    position: tuple[float, ...]  # world space
    right: tuple[float, ...]  # unit, world space: what is to the right in a picture of the hemisphere
    up: tuple[float, ...]
    radiance: np.ndarray  # (rows, columns), as `Learnt.q`
    spp: int  # samples of each patch


@dataclass(frozen=True)
class Run:
    """One finished render; the fields are those of result.json."""

    folder: Path
    scene: str
    method: str
    seed: int
    spp: int
    seconds: float  # rendering with learning, without compiling and export
    learn_seconds: float
    rays: int
    metrics: dict[str, float]
    settings: dict[str, Any]
    machine: dict[str, Any]
    versions: dict[str, Any]
    curve: list[dict[str, Any]]
    losses: list[float]  # one for each training step
    learnt: Learnt | None  # None where nothing was learnt, or nothing is known
    resolution: tuple[int, int] | None = None  # width and height; None where nothing is known
    digest: str | None = None  # SHA-256 of image.exr; None where nothing is known

    @property
    def learns(self) -> bool:
        """Whether its guide is one that learns: only they divide the hemisphere."""
        return "rows" in self.settings.get("guide", {})

    @property
    def train_seconds(self) -> float:
        """The part of `learn_seconds` that went into training, as far as the guide tells it apart."""
        return sum(entry.get("train_seconds", 0.0) for entry in self.curve)

    @property
    def infer_seconds(self) -> float:
        """The part of `learn_seconds` that went into laying out directions, as far as the guide tells it apart."""
        return sum(entry.get("infer_seconds", 0.0) for entry in self.curve)

    @property
    def row(self) -> list[Any]:
        """The run's values under `COLUMNS`."""
        return [self.metrics[name] if name in MEASURES else getattr(self, name) for name in COLUMNS]


class Estimate(NamedTuple):
    """A mean over seeds and half its 95 % interval, which a single seed does not have."""

    mean: float
    margin: float | None


@dataclass(frozen=True)
class Summary:
    """One method on one scene, over its seeds."""

    method: str
    runs: tuple[Run, ...]

    @cached_property
    def errors(self) -> dict[str, Estimate]:
        """Each measure's estimate by name."""
        return {name: estimate([run.metrics[name] for run in self.runs]) for name in MEASURES}

    @cached_property
    def seconds(self) -> Estimate:
        """Time of one render, learning included."""
        return estimate([run.seconds for run in self.runs])

    def share(self, part: str) -> float:
        """Share of the time that went into a part of learning, 0..1: "learn_seconds", "train_seconds" or "infer_seconds"."""
        return sum(getattr(run, part) for run in self.runs) / sum(run.seconds for run in self.runs)

    @property
    def megarays(self) -> float:
        """Million rays a second."""
        return sum(run.rays for run in self.runs) / sum(run.seconds for run in self.runs) / 1e6


@dataclass(frozen=True)
class Results:
    """All that an experiment's folder holds."""

    folder: Path
    name: str  # in the catalogue; empty for one that is not from there
    scenes: tuple[str, ...]
    methods: tuple[str, ...]
    baseline: str
    command: str
    reference: str  # what the errors are against, for people
    runs: tuple[Run, ...]
    missing: tuple[str, ...]  # what was asked for and is not there, as "scene/method/seed-n"
    truths: dict[str, Truth]  # by scene, where there is one
    damaged: tuple[str, ...] = ()  # what is there but cannot be used, a line for each
    pictured: frozenset[str] = frozenset()  # the scenes with a reference; the first run of each method there has an image

    def base(self, scene: str) -> Summary | None:
        """The baseline's summary, if it has a finished run on the scene."""
        return next((s for s in self.summaries(scene) if s.method == self.baseline), None)

    def summaries(self, scene: str) -> list[Summary]:
        """One for each method that has runs on the scene, in the experiment's order."""
        found = ((m, tuple(r for r in self.runs if (r.scene, r.method) == (scene, m))) for m in self.methods)
        return [Summary(method, runs) for method, runs in found if runs]


def estimate(values: Sequence[float]) -> Estimate:
    """Mean of at least one value; with two or more, Student's t gives the margin."""
    if len(values) < 2:
        return Estimate(values[0], None)
    return Estimate(statistics.fmean(values), _student(len(values) - 1) * statistics.stdev(values) / math.sqrt(len(values)))


def _student(freedom: int) -> float:
    """97.5 % quantile of Student's t: from the table, or by its series in 1 / freedom (Abramowitz and Stegun 26.7.5)."""
    if freedom <= len(_T):
        return _T[freedom - 1]
    z, n = 1.959964, freedom
    first, second = (z**3 + z) / 4, (5 * z**5 + 16 * z**3 + 3 * z) / 96
    third = (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384
    return z + first / n + second / n**2 + third / n**3


def ratio(ours: float, theirs: float) -> float:
    """Our error over theirs; equal errors, two zeros among them, are 1."""
    if ours == theirs:
        return 1.0
    return ours / theirs if theirs else math.inf


def ratio_of(ours: Estimate, theirs: Estimate) -> Estimate:
    """Our mean over theirs; the margin as if both errors were independent, to first order."""
    mean = ratio(ours.mean, theirs.mean)
    if ours.margin is None or theirs.margin is None or not (ours.mean and theirs.mean):
        return Estimate(mean, None)
    return Estimate(mean, mean * math.hypot(ours.margin / ours.mean, theirs.margin / theirs.mean))


def geometric_mean(values: Iterable[float]) -> float:
    """The mean for ratios: twice as good on one scene and half as good on another is 1."""
    values = list(values)
    return 0.0 if 0.0 in values else statistics.geometric_mean(values)


def table(results: Results) -> str:
    """table.csv: a row per scene, method and seed."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows([_no_formula(value) for value in run.row] for run in results.runs)
    return text.getvalue()


def _no_formula(value: Any) -> Any:
    """A name behind an apostrophe, where a spreadsheet would compute it."""
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")) else value
