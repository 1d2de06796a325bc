"""Guide `dqn`: a deep Q-network learns the incident radiance by expected SARSA while the image renders.

After each pass the network learns from replayed transitions. It is then evaluated once for each cell of a table. The tracer draws
directions from this table.

Differences from the published method (the slides):
1. What the tracer reads. Published: the network, at each vertex. Here: a table of the network's outputs over cells; `cells` = 32 lie
   along the scene's longest side.
2. Rewards. Published: not scaled. Here: scaled to a mean of 0.1 over the first pass with light.
3. The loss (`error`). Published: squared. Here: relative, divided by Q^2 + 0.01, because the relative error of a direction's probability
   matters (as in neural radiance caching, Mueller et al. 2021). The presets of the slides keep "squared".
4. Drawing directions (`weights`, `bsdf_fraction`). Published: in proportion to Q. Here: in proportion to Q cos(theta); the material
   draws a share of 0.3. The presets keep "radiance" and 0.
5. Hyperparameters. The presets keep the published values; the defaults of `DQN` differ. Published and here: learning_rate 1e-3, 1e-2;
   decay 0.995, 0.998; tau 1e-3, 0.1; batch 8192, 4096; memory 120,000, 500,000; learning_starts 100,000, 8192; steps after a sample 10
   (our choice, not published), 24. Here the first training has 300 steps.
"""

import ctypes
import platform
import time
from typing import Any

import numpy as np
import torch

from ..guide_settings import DQN
from ..memory import GUESSED, Part
from ..scene.data import SceneData
from .base import OnStep, Transitions, unheard
from .cell_count import cells_found
from .cells import CellTable, cell_size
from .patch_guide import PatchGuide
from .replay import BYTES, Experience, ReplayMemory
from .saved import Arrays, Saved, below
from .training import Training, due, to_come

TORCH_THREADS = 1  # sums round differently with other numbers, so every machine uses 1; more threads hardly help so small networks
MEAN_REWARD = 0.1  # of the scaled rewards: the range of the network's outputs then does not depend on the scene's brightness


class DQNGuide(PatchGuide[DQN]):
    """See `Guide`."""

    def __init__(self, settings: DQN, scene: SceneData, seed: int) -> None:
        torch.set_num_threads(TORCH_THREADS)
        _keep_freed_memory()
        torch.manual_seed(seed)
        low, high = scene.bounds
        super().__init__(settings, CellTable(low, cell_size(scene, settings.cells)))
        self._rng = np.random.default_rng(seed)
        self._centre, self._half = (low + high) / 2, np.maximum(high - low, 1e-6) / 2
        self._memory = ReplayMemory(settings.memory)
        self._training = Training(settings)
        self._scale = 0.0  # factor on rewards; 0 until a pass finds light

    @classmethod
    def memory(cls, settings: DQN, scene: SceneData, visits: float, rough: bool) -> list[Part]:
        cells, patches = visits if rough else cells_found(scene, settings.cells, visits), settings.rows * settings.columns
        inside = sum(settings.widths()[:-1]) + sum(settings.encoder.layers_of_its_own())
        shown = min(settings.batch, settings.memory, visits) * 4 * (2 * inside + 2 * settings.width + 3 * patches)
        table = cells * (300 + 24 * patches + 8 * inside)
        return [
            Part("replay memory", BYTES * min(settings.memory, visits), "the guide's memory", GUESSED),
            Part("network", 28.0 * settings.trained(), "the guide's width or layers"),
            Part("activations of a batch", float(shown), "the guide's batch, width or layers"),
            Part("table", table, "the guide's cells, rows or columns", GUESSED),
        ]

    def wanted(self) -> int:
        return self._settings.recorded if due(self._settings, self._training.steps) > 0 else 0

    def work(self, taken: int, passes: int) -> tuple[int, int]:
        """A unit is a training step."""
        done = self._training.steps
        return done, to_come(self._settings, done, passes)

    def learn(self, transitions: Transitions, on_step: OnStep = unheard) -> dict[str, Any]:
        """Store the pass's transitions, train, and tabulate the network's outputs."""
        steps = due(self._settings, self._training.steps)
        if steps <= 0:
            return {}  # insert no cells: the table would have no rows for them
        self._remember(transitions)
        if self._scale == 0.0 or len(self._memory) < self._settings.learning_starts:
            return {}
        start = time.perf_counter()
        losses = [self._train(on_step) for _ in range(steps)]
        trained = time.perf_counter()
        self._lay_out(self._outputs())
        seconds = {"train_seconds": trained - start, "infer_seconds": time.perf_counter() - trained}
        return {"loss": float(np.mean(losses)), "losses": losses, "steps": self._training.steps, "cells": self.cells.count} | seconds

    def q(self) -> np.ndarray:
        return self._outputs() / self._scale

    def state(self) -> Arrays:
        own = {"scale": np.array(self._scale)} | _state_of(self._rng)
        return own | self._training.state() | below("cells", self.cells.state()) | below("memory", self._memory.state())

    def restore(self, saved: Saved) -> None:
        """The table of directions is not saved: the network computes it again."""
        self._training.restore(saved)
        self._scale = float(saved.array("scale", np.float64))
        _restore(self._rng, saved)
        self.cells.restore(saved.below("cells"))
        self._memory.restore(saved.below("memory"), len(self._cosines))
        if self._training.steps:
            self._lay_out(self._outputs())

    def _remember(self, t: Transitions) -> None:
        """Add a pass to the cells and to the replay memory. The first pass with light sets the scale of rewards."""
        self.cells.insert(t.position, t.normal)
        x, y = self._scaled(t.position), self._scaled(t.next_position)
        self._memory.add(Experience(x, t.normal, self._patches(t), y, t.next_normal, t.reward, t.albedo))
        mean = float(t.reward.mean()) if t.reward.any() else 0.0
        if self._scale == 0.0 and mean > 0:
            self._scale = MEAN_REWARD / mean

    def _train(self, on_step: OnStep) -> float:
        """One step of training; returns its loss."""
        loss = self._training.step(self._memory.sample(self._settings.batch, self._rng), self._scale)
        on_step(self._training.steps)
        return loss

    def _outputs(self) -> np.ndarray:
        """Q of all patches of every cell, in units of scaled rewards: (C, N) float32."""
        position, normal = self.cells.states()
        return self._training.q(self._scaled(position), normal)

    def _scaled(self, position: np.ndarray) -> np.ndarray:
        """Positions, (n, 3) metres, mapped from the scene's bounds to [-1, 1]^3."""
        return ((position - self._centre) / self._half).astype(np.float32)


def _state_of(rng: np.random.Generator) -> Arrays:
    """The state of a generator without its seed: a counter of 128 bits, and the unused half of the last number."""
    state = rng.bit_generator.state
    low, high = state["state"]["state"] & (1 << 64) - 1, state["state"]["state"] >> 64
    return {"rng": np.array([low, high, state["has_uint32"], state["uinteger"]], np.uint64)}


def _restore(rng: np.random.Generator, saved: Saved) -> None:
    low, high, waits, half = saved.array("rng", np.uint64, 4).tolist()
    if waits > 1 or half >> 32:
        raise ValueError("the random numbers are in a state in which they cannot be")
    state = rng.bit_generator.state
    counted = state["state"] | {"state": high << 64 | low}
    rng.bit_generator.state = {**state, "state": counted, "has_uint32": waits, "uinteger": half}


def _keep_freed_memory() -> None:
    """Make glibc keep the memory that torch frees.

    Otherwise each tensor of some MB gets fresh pages, and a training step takes 1.3 to 1.5 times as long.
    """
    if platform.libc_ver()[0] == "glibc":
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(-3, 32 << 20)  # M_MMAP_THRESHOLD, its largest value
        mallopt(-1, 256 << 20)  # M_TRIM_THRESHOLD


GUIDE = DQNGuide
