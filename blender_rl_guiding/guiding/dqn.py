"""Guide `dqn`: a deep Q-network learns the incident radiance by expected SARSA while the image renders.

The network learns from replayed transitions after every pass; then it is evaluated once for each cell of a table, and the
tracer draws directions from that table.
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
from .base import TRANSITION, OnStep, Transitions, unheard
from .cell_count import cells_found
from .cells import CellTable, cell_size
from .network import QNetwork, soft_update, target_of
from .optimisers import make_optimiser
from .patch_guide import PatchGuide
from .patches import patches_of
from .replay import ReplayMemory
from .saved import Arrays, Saved, below

TORCH_THREADS = 1  # the rounding of sums depends on it, so it must not follow the machine; more hardly help networks this small
MEAN_REWARD = 0.1  # what rewards are scaled to, so that the network's outputs have one range whatever the scene's brightness
SMALL_Q = 0.01  # what the relative error adds to Q squared


class DQNGuide(PatchGuide):
    """See `Guide`.

    Departs from the method as published: (1) the tracer reads the network through a table over cells; (2) rewards are scaled to
    a mean of 0.1 over the first pass that saw light; (3) the loss may be relative to Q^2, because a direction's probability has to be right
    relative to itself (as in neural radiance caching, Mueller et al. 2021).
    """

    def __init__(self, settings: DQN, scene: SceneData, seed: int) -> None:
        torch.set_num_threads(TORCH_THREADS)
        _keep_freed_memory()
        torch.manual_seed(seed)
        low, high = scene.bounds
        super().__init__(settings, CellTable(low, cell_size(scene, settings.cells)))
        self._training = settings
        self._rng = np.random.default_rng(seed)
        self._centre, self._half = (low + high) / 2, np.maximum(high - low, 1e-6) / 2
        self._memory = ReplayMemory(settings.memory)
        self._online = QNetwork(settings)
        self._target = target_of(self._online)
        self._optimiser = make_optimiser(self._online.parameters(), settings)
        self._weights = torch.from_numpy(self._cosines)  # of the patches in what leaves a point
        self._scale = 0.0  # on rewards; 0 while no light was found
        self._steps = 0

    @classmethod
    def memory(cls, settings: DQN, scene: SceneData, visits: float, rough: bool) -> list[Part]:
        cells, patches = visits if rough else cells_found(scene, settings.cells, visits), settings.rows * settings.columns
        inside = sum(settings.widths()[:-1]) + sum(settings.encoder.layers_of_its_own())
        shown = min(settings.batch, settings.memory, visits) * 4 * (2 * inside + 2 * settings.width + 3 * patches)
        table = cells * (300 + 24 * patches + 8 * inside)
        return [
            Part("replay memory", TRANSITION * min(settings.memory, visits), "the guide's memory", GUESSED),
            Part("network", 28.0 * settings.trained(), "the guide's width or layers"),
            Part("activations of a batch", float(shown), "the guide's batch, width or layers"),
            Part("table", table, "the guide's cells, rows or columns", GUESSED),
        ]

    def wanted(self) -> int:
        return self._training.recorded if self._steps_to_do() > 0 else 0

    def work(self, taken: int, passes: int) -> tuple[int, int]:
        """In training steps."""
        s = self._training
        to_come = max(0, s.first_steps - self._steps) + passes * s.steps
        return self._steps, min(to_come, s.max_steps - self._steps)

    def _steps_to_do(self) -> int:
        """Training steps after the next pass, if there is enough to learn from by then."""
        s = self._training
        return min(s.steps if self._steps else s.first_steps, s.max_steps - self._steps)

    def learn(self, transitions: Transitions, on_step: OnStep = unheard) -> dict[str, Any]:
        """Remember the pass, train, and lay the network out as a table."""
        settings, steps = self._training, self._steps_to_do()
        if steps <= 0:
            return {}  # a cell more would have no row in the table
        self.cells.insert(transitions.position, transitions.normal)
        self._memory.add(transitions)
        if self._scale == 0.0 and transitions.reward.any() and (mean := float(transitions.reward.mean())) > 0:
            self._scale = MEAN_REWARD / mean
        if self._scale == 0.0 or len(self._memory) < settings.learning_starts:
            return {}
        start = time.perf_counter()
        losses = []
        for _ in range(steps):
            losses.append(self._train(self._memory.sample(settings.batch, self._rng)))
            self._steps += 1
            on_step(self._steps)
        trained = time.perf_counter()
        self._tabulate()
        seconds = {"train_seconds": trained - start, "infer_seconds": time.perf_counter() - trained}
        return {"loss": float(np.mean(losses)), "losses": losses, "steps": self._steps, "cells": self.cells.count} | seconds

    def state(self) -> Arrays:
        arrays = {name: tensor.detach().numpy() for name, tensor in self._tensors().items()}
        numbers = {"steps": np.array(self._steps), "scale": np.array(self._scale)}
        return arrays | numbers | _state_of(self._rng) | below("cells", self.cells.state()) | below("memory", self._memory.state())

    @torch.no_grad()
    def restore(self, saved: Saved) -> None:
        """Directions follow from the rest."""
        for name, tensor in self._tensors().items():
            tensor.copy_(torch.from_numpy(saved.array(name, np.float32, *tensor.shape)))
        self._steps = self._optimiser.steps = saved.whole("steps", 0, self._training.max_steps)
        if self._steps and not self._training.first_steps:
            raise ValueError(f"{self._steps} steps of training, where there is none")
        self._scale = float(saved.array("scale", np.float64))
        _restore(self._rng, saved)
        self.cells.restore(saved.below("cells"))
        self._memory.restore(saved.below("memory"))
        if self._steps:
            self._tabulate()

    def _tensors(self) -> dict[str, torch.Tensor]:
        """All that training changes."""
        kept = {
            "online": self._online.parameters(),
            "target": self._target.parameters(),
            "optimiser": self._optimiser.tensors(),
        }
        return {f"{name}-{k}": tensor for name, tensors in kept.items() for k, tensor in enumerate(tensors)}

    def _train(self, batch: Transitions) -> float:
        """One step on the mean over the batch of (Q(s, a; w) - target(s'))^2, or of that relative to Q^2.

        The target is that of w-, through which no gradient flows. C-DQN takes for each transition the larger of that loss and the one
        whose target is that of w itself, where the gradient flows through both (Wang and Ueda 2022).
        """
        s = self._training
        patches = np.empty(len(batch.reward), np.int64)
        patches_of(s.rows, s.columns, batch.normal, batch.direction, patches)
        q = self._online.of_patch(*self._state(batch.position, batch.normal), torch.from_numpy(patches))
        with torch.no_grad():
            target = self._expected_sarsa(batch, self._target)
        error = (q - target).square()
        if s.loss == "cdqn":
            error = torch.maximum(error, (q - self._expected_sarsa(batch, self._online)).square())
        if s.error == "relative":
            error = error / (q.detach().square() + SMALL_Q)
        loss = error.mean()
        loss.backward()
        self._optimiser.step()
        soft_update(self._target, self._online, s.tau)
        return loss.item()

    def _expected_sarsa(self, batch: Transitions, network: QNetwork) -> torch.Tensor:
        """r + (2 pi / N) sum_k Q(s', k) albedo / pi cos(theta_k), with the cosine's exact mean over each patch."""
        arriving = network(*self._state(batch.next_position, batch.next_normal)) @ self._weights
        reward, albedo = torch.from_numpy(batch.reward), torch.from_numpy(batch.albedo)
        return reward * self._scale + albedo * (2 / len(self._cosines)) * arriving

    @torch.no_grad()
    def q(self) -> np.ndarray:
        """The estimate of the mean radiance through each patch of each cell, (C, N) float32."""
        return self._online(*self._state(*self.cells.states())).numpy() / self._scale

    @torch.no_grad()
    def _tabulate(self) -> None:
        """Patch probabilities of every cell by the online network."""
        self._lay_out(self._online(*self._state(*self.cells.states())).numpy())

    def _state(self, position: np.ndarray, normal: np.ndarray) -> tuple[torch.Tensor, torch.Tensor]:
        """x in [-1, 1]^3 by the scene's bounds, and n."""
        return torch.from_numpy(((position - self._centre) / self._half).astype(np.float32)), torch.from_numpy(normal)


def _state_of(rng: np.random.Generator) -> Arrays:
    """The state of a generator, but for its seed: a counter of 128 bits, and the unused half of the last number."""
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
    """Have glibc keep what torch frees: with fresh pages for every tensor of some MB a training step takes 1.3 to 1.5 times as long."""
    if platform.libc_ver()[0] == "glibc":
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(-3, 32 << 20)  # M_MMAP_THRESHOLD, its largest value
        mallopt(-1, 256 << 20)  # M_TRIM_THRESHOLD


GUIDE = DQNGuide
