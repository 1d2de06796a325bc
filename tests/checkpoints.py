"""Renders that are killed after a checkpoint, and a function that changes a checkpoint."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blender_rl_guiding.guiding.saved import digest
from blender_rl_guiding.render import Checkpoint, Result, checkpoint, render
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.settings import BSDF, Machine, Render
from tests import unions

MACHINE = Machine(batch=1024, checkpoint=1e-9)
SPP, KILLED = 7, 4  # samples of a render; passes before it is killed
LITTLE = {
    "rows": 2,
    "columns": 3,
    "width": 5,
    "learning_starts": 64,
    "batch": 64,
    "first_steps": 3,
    "steps": 2,
    "memory": 500,
    "recorded": 200,
    "across": 2,
}


class Killed(Exception):  # noqa: N818  # it is not an error
    """Ends a render as a signal would."""


def started(scene: SceneData, settings: Render, path: Path) -> None:
    """Kill a render after KILLED passes. The checkpoint has KILLED - 1 passes."""

    def on_pass(state: Result) -> None:
        state.curve[-1]["judged"] = float(state.image.mean())
        if len(state.curve) == KILLED:
            raise Killed

    with pytest.raises(Killed):
        render(scene, settings, MACHINE, on_pass, checkpoint=Checkpoint(path))


def told(result: Result) -> dict[str, Any]:
    """The result without the values that depend on the clock."""
    arrays = [result.image, *result.film.sums, *result.film.layers().values(), *result.guide.state().values()]
    directions = [*leaves(result.guide.directions())]
    seconds = {"seconds", "train_seconds", "infer_seconds"}
    return {
        "arrays": [array.tobytes() for array in (*arrays, *directions)],
        "curve": [{name: value for name, value in entry.items() if name not in seconds} for entry in result.curve],
        "rest": (result.losses, result.steps, result.rays, result.finished),
    }


def leaves(nested: Any) -> Iterator[np.ndarray]:
    """All arrays and numbers of a tuple of tuples."""
    if isinstance(nested, tuple):
        for inner in nested:
            yield from leaves(inner)
    else:
        yield np.asarray(nested)


def judged(state: Result) -> None:
    state.curve[-1]["judged"] = float(state.image.mean())


SETTINGS = {"bsdf": Render(spp=64, passes=True, guide=BSDF())}
SETTINGS |= {guide.kind: Render(spp=SPP, guide=guide) for guide in unions.guides(LITTLE) if guide.learns}


def change(path: Path, header: dict[str, Any] | None = None, arrays: dict[str, np.ndarray] | None = None, right: bool = True) -> None:
    """Change a checkpoint. right: write the matching SHA-256, too, like an attacker."""
    with np.load(path) as file:
        members = dict(file)
    said = json.loads(str(members.pop("header"))) | (header or {})
    del members["sha256"]
    members |= arrays or {}
    if right:
        said["digests"] = {name: digest(np.asarray(array, order="C")) for name, array in members.items()} | (header or {}).get(
            "digests", {}
        )
    text = json.dumps(said)
    np.savez(path, allow_pickle=False, **members, header=np.array(text), sha256=np.array(checkpoint._digest(text)))
