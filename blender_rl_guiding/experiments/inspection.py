"""Pictures of a learnt guide: its states over the image, and Q at one point beside the truth."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np

from ..errors import InputError, atomic
from ..guide_settings import GuideSettings
from ..guiding.base import Guide, Learnt
from ..guiding.directions import UNKNOWN
from ..images import png
from ..render import Result
from ..report import discs
from ..report.discs import Disc, Group, figure
from ..scene.data import SceneData
from ..settings import Guide as AnyGuide
from ..settings import Machine, Render
from . import probe, truth
from .produce import produce
from .progress import Progress
from .runs import Task

GREY, WHITE, BLACK = 128, 255, 0
_SIDE = 1.9  # inches


def check(guide: GuideSettings) -> None:
    """InputError if the guide does not learn."""
    if not guide.learns:
        learners = ", ".join(kind.kind for kind in get_args(AnyGuide) if kind.learns)
        raise InputError(f"guide {guide.kind!r} does not learn, so there is nothing to inspect: choose {learners} or a preset of theirs")


def inspect(task: Task, asked: Sequence[int] | None, machine: Machine, progress: Progress) -> list[Path]:
    """Make a run, and the pictures of its guide's Q at a pixel; returns their paths.

    InputError if the pixel lies outside of the image, or sees no surface that reflects, and as in `produce`.
    """
    pixel = probe.pixel_of(task.scene, asked)
    point = probe.find(task.scene, pixel, machine)
    if not point:
        raise InputError(f"pixel {pixel} of scene {task.scene.name!r} sees no surface that reflects: name another by --pixel X Y")
    with progress("Learning", 1) as advance:
        result = produce(replace(task, probe=point), machine, lambda pace: advance(pace.share))
    assert task.folder
    with progress("Measuring the light that arrives", 1):
        return write(task.folder, task.scene, point, task.settings, machine, result)


def write(folder: Path, scene: SceneData, point: probe.Point, settings: Render, machine: Machine, result: Result) -> list[Path]:
    """Make states.png and q.png; returns their paths. InputError if the folder cannot be written."""
    guide = result.guide
    arriving = truth.arriving(scene, point, settings.max_bounces, machine)
    with atomic(folder / "states.png") as part:
        part.write_bytes(png(states(probe.view(scene, machine), guide)))
    caption = discs.caption(scene.name, point.pixel, *truth.frame(scene, point))
    with atomic(folder / "q.png") as part:
        figure(_groups(arriving, guide.learnt(point.position, point.normal), settings), caption, _SIDE).savefig(part, dpi=200)
    return [folder / "states.png", folder / "q.png"]


def states(view: probe.View, guide: Guide) -> np.ndarray:
    """An image with a different colour for each state of the guide, (H, W, 3) uint8.

    Emitters are white, pixels without reflection black, reflecting pixels without a state grey.
    """
    numbers = guide.states(view.position.reshape(-1, 3), view.normal.reshape(-1, 3)).reshape(view.emits.shape)
    picture = _colours(numbers)
    picture[numbers == UNKNOWN] = GREY
    picture[~view.reflects] = BLACK
    picture[view.emits] = WHITE
    return picture


def _colours(rows: np.ndarray) -> np.ndarray:
    """A colour for each number, (..., 3) uint8. Numbers below 2^24 have different colours, because each step is invertible."""
    x = rows.astype(np.uint64) & 0xFFFFFF
    for factor in (0x9E3779, 0x85EBCB):
        x = (x ^ (x >> 12)) * factor & 0xFFFFFF
    x ^= x >> 12
    return np.stack([x >> 16, x >> 8 & 0xFF, x & 0xFF], axis=-1).astype(np.uint8)


def _groups(arriving: np.ndarray, learnt: Learnt | None, settings: Render) -> list[Group]:
    """The truth, and beside it Q at the point and the directions drawn."""
    radiance = [Disc(f"truth\n{arriving.shape[0]} x {arriving.shape[1]} directions", arriving)]
    if learnt is None:
        return [Group(radiance, discs.scale([arriving]), "radiance that arrives")]
    q, chances = learnt
    radiance.append(Disc(f"Q of {settings.guide.kind}\n{discs.verdict(q, arriving, settings.nee)}", q))
    drawn = Disc(f"directions drawn\n{q.shape[0]} x {q.shape[1]} patches", 100 * chances)
    return [
        Group(radiance, discs.scale([arriving, q]), "radiance that arrives"),
        Group([drawn], discs.scale([drawn.values]), "probability of a patch, %"),
    ]
