"""The network: shape, formula, gradients, gradients of the losses, and the update of the target network."""

from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from blender_rl_guiding.guiding.network import QNetwork, soft_update, target_of
from blender_rl_guiding.settings import DQN, BSpline, Encoder, NoEncoding
from tests import unions
from tests.gradients import assert_gradients

X, N = torch.tensor([[0.1, -0.25, 1.0], [0.0, 0.5, -1.0]]), torch.tensor([[0.0, 0.6, 0.8], [1.0, 0.0, 0.0]])


def dense_layers(network: QNetwork) -> list[torch.nn.Linear]:
    return [*(m for m in network.hidden if isinstance(m, torch.nn.Linear)), network.last]


def test_layers_count_dense_layers():
    for layers in (1, 2, 4):
        network = QNetwork(DQN(encoder=NoEncoding(), layers=layers, width=5, rows=2, columns=3))
        dense = dense_layers(network)
        assert [(d.in_features, d.out_features) for d in dense] == list(
            zip([6, *[5] * (layers - 1)], [*[5] * (layers - 1), 6], strict=True)
        )


@pytest.mark.parametrize(
    ("activation", "function"),
    [("relu", lambda v: np.maximum(v, 0)), ("silu", lambda v: v / (1 + np.exp(-v))), ("tanh", np.tanh)],
)
def test_output_is_a_softplus_of_what_the_layers_give(activation, function):
    torch.manual_seed(1)
    network = QNetwork(DQN(encoder=NoEncoding(), layers=3, width=4, rows=2, columns=3, activation=activation))
    *hidden, last = [(layer.weight.detach().numpy(), layer.bias.detach().numpy()) for layer in dense_layers(network)]
    values = np.concatenate([X, N], axis=1)
    for weight, bias in hidden:
        values = function(values @ weight.T + bias)
    weight, bias = last
    q = network(X, N)
    assert q.shape == (2, 6)
    np.testing.assert_allclose(q.detach(), np.log1p(np.exp(values @ weight.T + bias)), rtol=1e-5)


def test_one_patch_is_its_entry_among_all():
    network, patches = QNetwork(DQN(layers=3, width=8, rows=2, columns=3)), torch.tensor([5, 0])
    np.testing.assert_allclose(network.of_patch(X, N, patches).detach(), network(X, N)[[0, 1], patches].detach(), rtol=1e-5)


# --- gradients -------------------------------------------------------------------------------------------------------

STATES = 40


def dqn(network: QNetwork, x: Tensor, n: Tensor, patch: Tensor, target: Tensor) -> Tensor:
    return (network.of_patch(x, n, patch) - target).square()


def msbe(network: QNetwork, x: Tensor, n: Tensor, patch: Tensor, target: Tensor) -> Tensor:
    """The same with the target of the online network itself. The gradient also flows through this target. The state after i is i - 1."""
    own = target + network(x.roll(1, 0), n.roll(1, 0)).mean(dim=1) - network(x, n).mean()
    return (network.of_patch(x, n, patch) - own).square()


def cdqn(*arguments) -> Tensor:
    return torch.maximum(dqn(*arguments), msbe(*arguments))


@pytest.mark.parametrize("activation", ["relu", "silu", "tanh"])
@pytest.mark.parametrize("loss", [dqn, cdqn])
@pytest.mark.parametrize("encoder", unions.every_encoder(), ids=unions.name)
def test_gradients_are_those_of_finite_differences(encoder: Encoder, loss: Callable, activation):
    torch.manual_seed(1)
    network = QNetwork(DQN(encoder=encoder, layers=3, width=8, rows=2, columns=3, activation=activation)).double()
    x = (2 * torch.rand(STATES, 3, dtype=torch.float64) - 1).requires_grad_()
    n = nn.functional.normalize(torch.randn(STATES, 3, dtype=torch.float64), dim=1).requires_grad_()
    patch, target = torch.randint(6, (STATES,)), 2 * torch.rand(STATES, dtype=torch.float64)
    arguments = network, x, n, patch, target
    greater = msbe(*arguments) > dqn(*arguments)
    assert 5 < greater.sum() < STATES - 5  # both sides of C-DQN's maximum occur
    assert_gradients(lambda: loss(*arguments).mean(), (x, n, *network.parameters()))


# --- the target network ----------------------------------------------------------------------------------------------


def test_target_is_an_equal_copy_that_no_gradient_reaches():
    online = QNetwork(DQN(layers=2, width=4))
    target = target_of(online)
    assert torch.equal(target(X, N), online(X, N))
    assert not target(X, N).requires_grad
    assert online(X, N).requires_grad
    with torch.no_grad():
        next(online.parameters()).add_(1)
    assert not torch.equal(target(X, N), online(X, N))


def test_soft_update_reaches_what_an_encoder_trains():
    online = QNetwork(DQN(encoder=BSpline(reads="matrix"), layers=2, width=4))
    target = target_of(online)
    with torch.no_grad():
        for parameter in online.parameters():
            parameter.add_(0.2)
    soft_update(target, online, 1.0)
    assert torch.equal(target(X, N), online(X, N))


@pytest.mark.parametrize("tau", [0.0, 0.25, 1.0])
def test_soft_update(tau):
    online, target = (QNetwork(DQN(layers=2, width=4)) for _ in range(2))
    before = [p.clone() for p in target.parameters()]
    soft_update(target, online, tau)
    for now, old, new in zip(target.parameters(), before, online.parameters(), strict=True):
        np.testing.assert_allclose(now.detach(), ((1 - tau) * old + tau * new).detach(), rtol=1e-5, atol=1e-7)
