"""A step of gradient descent by the guide moves its network along the gradient of the loss, written anew in double precision."""

import copy
from dataclasses import replace

import numpy as np
import pytest
import torch

from blender_rl_guiding.guiding.base import Transitions
from blender_rl_guiding.guiding.dqn import SMALL_Q, DQNGuide
from blender_rl_guiding.guiding.network import QNetwork
from blender_rl_guiding.guiding.patches import mean_cosines
from blender_rl_guiding.settings import DQN, RBF, BSpline, Frequency, NoEncoding
from tests import scenes

ROWS, COLUMNS, RATE = 4, 6, 1.0
UP = (0.0, 0.0, 1.0)


def transitions(patch: np.ndarray, rng: np.random.Generator) -> Transitions:
    """Between random points of walls that face up, through the middle of each patch in the frame whose axes are x and y."""
    count = len(patch)
    cosine, phi = (patch // COLUMNS + 0.5) / ROWS, (patch % COLUMNS + 0.5) / COLUMNS * 2 * np.pi
    sine = np.sqrt(1 - cosine**2)
    directions = np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], axis=1)
    here, there = rng.uniform(-1, 1, (2, count, 3))
    normals = np.tile(UP, (count, 1))
    values = here, normals, directions, there, normals, rng.exponential(size=count), rng.random(count)
    return Transitions(*(value.astype(np.float32) for value in values))


@pytest.mark.parametrize("loss", ["dqn", "cdqn"])
@pytest.mark.parametrize("error", ["squared", "relative"])
@pytest.mark.parametrize("encoder", [NoEncoding(), Frequency(), RBF(), BSpline(), BSpline(reads="matrix")], ids=lambda e: e.kind)
def test_a_step_follows_the_gradient(encoder, error, loss):
    common = DQN(encoder=encoder, layers=2, width=16, rows=ROWS, columns=COLUMNS, optimiser="sgd", learning_rate=RATE)
    settings = replace(common, error=error, loss=loss)
    guide, rng = DQNGuide(settings, scenes.furnace_box(0.5, 1.0), seed=3), np.random.default_rng(4)
    guide._scale = 0.5
    guide._target = QNetwork(settings).requires_grad_(False)  # another network, so that the two cannot be mistaken for each other
    online, target = copy.deepcopy(guide._online).double(), copy.deepcopy(guide._target).double()
    patch = rng.integers(ROWS * COLUMNS, size=64)
    batch = transitions(patch, rng)
    trained = guide._train(batch)

    x, n, y, m = (v.double() for v in (*guide._state(batch.position, batch.normal), *guide._state(batch.next_position, batch.next_normal)))
    q = online(x, n)[torch.arange(len(patch)), torch.from_numpy(patch)]
    cosines = torch.from_numpy(mean_cosines(ROWS, COLUMNS))

    def squares(network: torch.nn.Module) -> torch.Tensor:
        value = 2 / (ROWS * COLUMNS) * (network(y, m) * cosines).sum(dim=1)
        return (q - 0.5 * torch.from_numpy(batch.reward) - torch.from_numpy(batch.albedo) * value) ** 2

    chosen = torch.maximum(squares(target), squares(online)) if loss == "cdqn" else squares(target)
    if loss == "cdqn":
        assert 5 < (squares(online) > squares(target)).sum() < 59  # both are chosen
    mean = (chosen / (q.detach() ** 2 + SMALL_Q if error == "relative" else 1)).mean()
    gradients = torch.autograd.grad(mean, list(online.parameters()))
    assert trained == pytest.approx(mean.item(), rel=1e-4)
    for before, after, gradient in zip(online.parameters(), guide._online.parameters(), gradients, strict=True):
        moved = (after.double() - before).detach()
        assert gradient.abs().max() > 1e-6
        np.testing.assert_allclose(moved, -RATE * gradient, rtol=1e-3, atol=2e-4 * gradient.abs().max().item() + 1e-7)
