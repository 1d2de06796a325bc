"""Renders that are killed after a checkpoint, and a function that changes a checkpoint."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blender_rl_guiding.guiding.saved import digest
from blender_rl_guiding.render import Checkpoint, Result, checkpoint, render
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.schema import Settings, entries
from blender_rl_guiding.settings import BSDF, DQN, Machine, QTable, Render

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


class Killed(Exception):  # noqa: N818  # no error
    """Ends a render as a signal would."""


def small(settings: Settings) -> Settings:
    """The same, with little to learn."""
    known = {entry.name: entry for entry in entries(type(settings))}
    inner = {name: small(getattr(settings, name)) for name, entry in known.items() if entry.variants}
    return replace(settings, **{name: value for name, value in LITTLE.items() if name in known}, **inner)  # type: ignore[type-var]


def started(scene: SceneData, settings: Render, path: Path) -> None:
    """Kill a render after KILLED passes. The checkpoint holds one pass fewer."""

    def on_pass(state: Result) -> None:
        state.curve[-1]["judged"] = float(state.image.mean())
        if len(state.curve) == KILLED:
            raise Killed

    with pytest.raises(Killed):
        render(scene, settings, MACHINE, on_pass, checkpoint=Checkpoint(path))


def told(result: Result) -> dict[str, Any]:
    """The result without what depends on the clock."""
    arrays = [result.image, *result.film.sums, *result.film.layers().values(), *result.guide.state().values()]
    table = result.guide.directions()
    seconds = {"seconds", "train_seconds", "infer_seconds"}
    return {
        "arrays": [array.tobytes() for array in (*arrays, table.cdf, table.bsdf_fraction)],
        "curve": [{name: value for name, value in entry.items() if name not in seconds} for entry in result.curve],
        "rest": (result.losses, result.steps, result.rays, result.finished),
    }


def judged(state: Result) -> None:
    state.curve[-1]["judged"] = float(state.image.mean())


SETTINGS = {
    "bsdf": Render(spp=64, passes=True, guide=BSDF()),
    "qtable": Render(spp=SPP, guide=small(QTable())),
    "dqn": Render(spp=SPP, guide=small(DQN())),
}


def change(path: Path, header: dict[str, Any] | None = None, arrays: dict[str, np.ndarray] | None = None, right: bool = True) -> None:
    """Change a checkpoint. `right`: write the SHA-256 that fits, as an attacker would."""
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
