"""The runs of an experiment, what is missing or damaged, means over seeds and their intervals."""

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, get_args

import numpy as np

from ..images.metrics import mape_map
from ..measures import NAMES
from ..settings import Guide
from .result_file import Count, Error, Number, Patches, Record

COLUMNS = ("scene", "method", "seed", "spp", "seconds", "learn_seconds", "train_seconds", "infer_seconds", "rays", *NAMES)
LEARNING_GUIDES = {guide.kind for guide in get_args(Guide) if guide.learns}
_Vector = tuple[Number, Number, Number]
# 97.5 % quantiles of Student's t for 1..9 degrees of freedom; from 10 on, the series in `_student` has four digits.
_T = (12.7062, 4.30265, 3.18245, 2.77645, 2.57058, 2.44691, 2.36462, 2.30600, 2.26216)


@dataclass(frozen=True)
class Truth:
    """probe.json: the light that arrives at the surface point behind a pixel."""

    pixel: tuple[int, int]  # column and row, from the top left
    position: _Vector  # world space
    right: _Vector  # unit vector in world space that points right in a picture of the hemisphere
    up: _Vector
    patches: tuple[Patches, Patches]  # rows and columns
    radiance: tuple[Error, ...]  # mean through each patch of the hemisphere, row 0 at the horizon
    spp: Count  # samples of each patch

    @property
    def hemisphere(self) -> np.ndarray:
        """`radiance` as (rows, columns)."""
        return np.array(self.radiance).reshape(self.patches)


@dataclass(frozen=True, kw_only=True)
class Run(Record):
    """One finished render: its result.json and its folder."""

    folder: Path
    metrics: dict[str, float]  # reports contain only runs with errors

    @property
    def learns(self) -> bool:
        """Whether its guide learns."""
        return self.settings.get("guide", {}).get("kind") in LEARNING_GUIDES

    @property
    def nee(self) -> bool:
        """Whether it has next-event estimation."""
        return bool(self.settings.get("nee"))

    @property
    def train_seconds(self) -> float:
        """The training time within `learn_seconds`; 0 if the guide does not measure it."""
        return sum(entry.get("train_seconds", 0.0) for entry in self.curve)

    @property
    def infer_seconds(self) -> float:
        """The time within `learn_seconds` for the table of directions; 0 if the guide does not measure it."""
        return sum(entry.get("infer_seconds", 0.0) for entry in self.curve)

    @property
    def row(self) -> list[Any]:
        """The run's values under `COLUMNS`."""
        return [self.metrics[name] if name in NAMES else getattr(self, name) for name in COLUMNS]


class Pictures(NamedTuple):
    """A scene's reference and the image of each method's first run, (H, W, 3) linear RGB."""

    reference: np.ndarray
    shots: Sequence[tuple[Run, np.ndarray]]

    def error_maps(self) -> list[np.ndarray]:
        """For each shot its error at each pixel, (H, W)."""
        return [mape_map(image, self.reference) for _, image in self.shots]


class Estimate(NamedTuple):
    """A mean over seeds and half its 95 % interval; a single seed has no interval."""

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
        return {name: estimate([run.metrics[name] for run in self.runs]) for name in NAMES}

    @cached_property
    def seconds(self) -> Estimate:
        """Time of one render, learning included."""
        return estimate([run.seconds for run in self.runs])

    def share(self, part: str) -> float:
        """Share of the time, 0..1, for all of learning or a part of it: "learn_seconds", "train_seconds" or "infer_seconds"."""
        return sum(getattr(run, part) for run in self.runs) / sum(run.seconds for run in self.runs)

    @property
    def megarays(self) -> float:
        """Million rays a second."""
        return sum(run.rays for run in self.runs) / sum(run.seconds for run in self.runs) / 1e6


@dataclass(frozen=True)
class Results:
    """All that an experiment's folder holds."""

    folder: Path
    name: str  # its name in the catalogue; empty if it is not in the catalogue
    scenes: tuple[str, ...]
    methods: tuple[str, ...]
    baseline: str
    command: str
    reference: str  # of the errors, described for people
    runs: tuple[Run, ...]
    missing: tuple[str, ...]  # runs of the plan without results, as "scene/method/seed-n"
    truths: dict[str, Truth]  # by scene, where there is one
    damaged: tuple[str, ...] = ()  # a line for each file that cannot be used
    pictures: dict[str, Pictures] = field(default_factory=dict)  # by scene, where there is a reference

    @property
    def reported(self) -> list[str]:
        """The scenes with a finished run."""
        return [scene for scene in self.scenes if self.summaries(scene)]

    def base(self, scene: str) -> Summary | None:
        """The baseline's summary, if it has a finished run on the scene."""
        return next((s for s in self.summaries(scene) if s.method == self.baseline), None)

    def summaries(self, scene: str) -> list[Summary]:
        """One for each method that has runs on the scene, in the experiment's order."""
        found = ((m, tuple(r for r in self.runs if (r.scene, r.method) == (scene, m))) for m in self.methods)
        return [Summary(method, runs) for method, runs in found if runs]

    def learnt(self, scene: str) -> tuple[Truth, list[tuple[Run, np.ndarray]]] | None:
        """The truth, and each method's first run if its Q belongs to the same pixel. None if there is no truth, or no method learns."""
        truth, first = self.truths.get(scene), [summary.runs[0] for summary in self.summaries(scene)]
        if truth is None or not any(run.learns for run in first):
            return None
        return truth, [(run, run.probe.hemisphere) for run in first if run.probe and run.probe.pixel == truth.pixel]


def estimate(values: Sequence[float]) -> Estimate:
    """Mean of at least one value. With two or more values, Student's t gives the margin."""
    if len(values) < 2:
        return Estimate(values[0], None)
    return Estimate(statistics.fmean(values), _student(len(values) - 1) * statistics.stdev(values) / math.sqrt(len(values)))


def _student(freedom: int) -> float:
    """97.5 % quantile of Student's t: from the table, or from its series in 1 / freedom (Abramowitz and Stegun 26.7.5)."""
    if freedom <= len(_T):
        return _T[freedom - 1]
    z, n = 1.959964, freedom
    first, second = (z**3 + z) / 4, (5 * z**5 + 16 * z**3 + 3 * z) / 96
    third = (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384
    return z + first / n + second / n**2 + third / n**3


def ratio(ours: float, theirs: float) -> float:
    """Our error / their error. For equal errors it is 1, also if both are 0."""
    if ours == theirs:
        return 1.0
    return ours / theirs if theirs else math.inf


def ratio_of(ours: Estimate, theirs: Estimate) -> Estimate:
    """Our mean / their mean. The margin is a first-order estimate for independent errors."""
    mean = ratio(ours.mean, theirs.mean)
    if ours.margin is None or theirs.margin is None or not (ours.mean and theirs.mean):
        return Estimate(mean, None)
    return Estimate(mean, mean * math.hypot(ours.margin / ours.mean, theirs.margin / theirs.mean))


def geometric_mean(values: Iterable[float]) -> float:
    """The geometric mean of ratios: the mean of 2 and 1/2 is 1."""
    values = list(values)
    return 0.0 if 0.0 in values else statistics.geometric_mean(values)
