"""Losses equal values by hand. A training step moves the network along their gradient, computed again in double precision."""

import copy
from dataclasses import replace

import numpy as np
import pytest
import torch

from blender_rl_guiding.guiding.losses import SMALL_Q, expected_sarsa, mean_loss
from blender_rl_guiding.guiding.network import QNetwork
from blender_rl_guiding.guiding.patches import mean_cosines
from blender_rl_guiding.guiding.replay import Experience
from blender_rl_guiding.guiding.training import Training
from blender_rl_guiding.settings import DQN
from tests import unions

ROWS, COLUMNS, RATE = 4, 6, 1.0
N, COSINES = ROWS * COLUMNS, torch.from_numpy(mean_cosines(ROWS, COLUMNS))
UP = (0.0, 0.0, 1.0)


def test_expected_sarsa_by_hand():
    q = np.random.default_rng(1).exponential(size=N)
    value = 2 * np.pi / N * (q * COSINES.numpy()).sum() / np.pi  # (2 pi / N) sum_k Q_k f cos_k, for albedo 1
    reward, albedo = torch.tensor([0, 2.0, 2.0, 0]), torch.tensor([1, 0, 0.25, 0])
    target = expected_sarsa(reward, albedo, torch.from_numpy(q).float().expand(4, -1), COSINES)
    np.testing.assert_allclose(target, [value, 2, 2 + 0.25 * value, 0], rtol=1e-5)


def test_value_of_an_even_sky_is_albedo_times_radiance():
    target = expected_sarsa(torch.tensor([0.0, 1.0]), torch.tensor([0.6, 0.6]), torch.full((2, N), 0.7), COSINES)
    np.testing.assert_allclose(target, [0.42, 1.42], rtol=1e-5)


@pytest.mark.parametrize("relative", [False, True])
def test_the_mean_loss_by_hand(relative):
    q, target, own = torch.tensor([0.5, 2.0]), torch.tensor([1.0, 2.5]), torch.tensor([0.6, 0.0])
    weights = 1 / (np.array([0.5, 2.0]) ** 2 + SMALL_Q) if relative else np.ones(2)
    assert mean_loss(q, target, relative=relative).item() == pytest.approx((0.25 * weights).mean())
    assert mean_loss(q, target, own, relative).item() == pytest.approx((np.array([0.25, 4.0]) * weights).mean())


def test_the_gradient_flows_through_q_and_its_own_target_alone():
    """The gradient of (q - t)^2 / 2, a mean over 2 states. In state 2 the own target is further away. The divisor Q^2 is constant."""
    q, own = torch.tensor([0.5, 2.0], requires_grad=True), torch.tensor([0.6, 0.0], requires_grad=True)
    mean_loss(q, torch.tensor([1.0, 2.5]), own, relative=True).backward()
    scale = np.array([0.5, 2.0]) ** 2 + SMALL_Q
    np.testing.assert_allclose(q.grad, np.array([0.5 - 1.0, 2.0 - 0.0]) / scale, rtol=1e-6)
    np.testing.assert_allclose(own.grad, np.array([0, -(2.0 - 0.0)]) / scale, rtol=1e-6)


def experience(rng: np.random.Generator, count: int) -> Experience:
    """Transitions between random points of floors (normals +z)."""
    x, y = rng.uniform(-1, 1, (2, count, 3)).astype(np.float32)
    up = np.tile(np.float32(UP), (count, 1))
    reward, albedo = rng.exponential(size=count).astype(np.float32), rng.random(count).astype(np.float32)
    return Experience(x, up, rng.integers(N, size=count).astype(np.int32), y, up, reward, albedo)


@pytest.mark.parametrize("loss", ["dqn", "cdqn"])
@pytest.mark.parametrize("error", ["squared", "relative"])
@pytest.mark.parametrize("encoder", unions.every_encoder(), ids=unions.name)
def test_a_step_follows_the_gradient(encoder, error, loss):
    common = DQN(encoder=encoder, layers=2, width=16, rows=ROWS, columns=COLUMNS, optimiser="sgd", learning_rate=RATE)
    settings = replace(common, error=error, loss=loss)
    torch.manual_seed(3)
    training = Training(settings)
    training.target = QNetwork(settings).requires_grad_(False)  # another network than the online one, so that mixing them up has an effect
    online, target = copy.deepcopy(training.online).double(), copy.deepcopy(training.target).double()
    batch = experience(np.random.default_rng(4), 64)
    trained = training.step(batch, 0.5)

    x, n, y, m = (torch.from_numpy(v).double() for v in (batch.x, batch.n, batch.y, batch.m))
    q = online(x, n)[torch.arange(64), torch.from_numpy(batch.patch).long()]

    def squares(network: torch.nn.Module) -> torch.Tensor:
        value = 2 / N * (network(y, m) * COSINES).sum(dim=1)
        return (q - 0.5 * torch.from_numpy(batch.reward) - torch.from_numpy(batch.albedo) * value) ** 2

    chosen = torch.maximum(squares(target), squares(online)) if loss == "cdqn" else squares(target)
    if loss == "cdqn":
        assert 5 < (squares(online) > squares(target)).sum() < 59  # the maximum takes each of them sometimes
    mean = (chosen / (q.detach() ** 2 + SMALL_Q if error == "relative" else 1)).mean()
    gradients = torch.autograd.grad(mean, list(online.parameters()))
    assert trained == pytest.approx(mean.item(), rel=1e-4)
    for before, after, gradient in zip(online.parameters(), training.online.parameters(), gradients, strict=True):
        moved = (after.double() - before).detach()
        assert gradient.abs().max() > 1e-6
        np.testing.assert_allclose(moved, -RATE * gradient, rtol=1e-3, atol=2e-4 * gradient.abs().max().item() + 1e-7)
