"""Encoders against their closed forms, the network's shape, and the target network's update."""

import math

import numpy as np
import pytest
import torch

from blender_rl_guiding.guiding.encoders import make_encoder
from blender_rl_guiding.guiding.network import QNetwork, soft_update, target_of
from blender_rl_guiding.settings import DQN, Frequency, NoEncoding

X, N = torch.tensor([[0.1, -0.25, 1.0], [0.0, 0.5, -1.0]]), torch.tensor([[0.0, 0.6, 0.8], [1.0, 0.0, 0.0]])


def test_no_encoding():
    encoder = make_encoder(NoEncoding())
    assert encoder.width == 6
    assert torch.equal(encoder(X, N), torch.cat([X, N], dim=1))


@pytest.mark.parametrize("octaves", [1, 3, 8])
def test_frequency_encoding(octaves):
    encoder = make_encoder(Frequency(octaves))
    encoded = encoder(X, N)
    assert encoded.shape == (2, encoder.width) == (2, 6 + 6 * octaves)
    for row, x, n in zip(encoded.tolist(), X.tolist(), N.tolist(), strict=True):
        angles = [2**octave * math.pi * c for octave in range(octaves) for c in x]
        expected = [*x, *map(math.sin, angles), *map(math.cos, angles), *n]
        assert row == pytest.approx(expected, abs=1e-4)


def dense_layers(network: QNetwork) -> list[torch.nn.Linear]:
    return [*(m for m in network.hidden if isinstance(m, torch.nn.Linear)), network.last]


def test_layers_count_dense_layers():
    for layers in (1, 2, 4):
        network = QNetwork(DQN(encoder=NoEncoding(), layers=layers, width=5, rows=2, columns=3))
        dense = dense_layers(network)
        assert [(d.in_features, d.out_features) for d in dense] == list(
            zip([6, *[5] * (layers - 1)], [*[5] * (layers - 1), 6], strict=True)
        )


def test_output_is_a_softplus_of_what_the_layers_give():
    network = QNetwork(DQN(encoder=NoEncoding(), layers=2, width=4, rows=2, columns=3))
    first, second = dense_layers(network)
    hidden = (torch.cat([X, N], dim=1) @ first.weight.T + first.bias).clamp(min=0)
    q = network(X, N)
    assert q.shape == (2, 6)
    expected = torch.log1p(torch.exp(hidden @ second.weight.T + second.bias))
    np.testing.assert_allclose(q.detach(), expected.detach(), rtol=1e-5)


def test_one_patch_is_its_entry_among_all():
    network, patches = QNetwork(DQN(layers=3, width=8, rows=2, columns=3)), torch.tensor([5, 0])
    np.testing.assert_allclose(network.of_patch(X, N, patches).detach(), network(X, N)[[0, 1], patches].detach(), rtol=1e-5)


def test_target_is_an_equal_copy_that_no_gradient_reaches():
    online = QNetwork(DQN(layers=2, width=4))
    target = target_of(online)
    assert torch.equal(target(X, N), online(X, N))
    assert not target(X, N).requires_grad
    assert online(X, N).requires_grad
    with torch.no_grad():
        next(online.parameters()).add_(1)
    assert not torch.equal(target(X, N), online(X, N))


@pytest.mark.parametrize("tau", [0.0, 0.25, 1.0])
def test_soft_update(tau):
    online, target = (QNetwork(DQN(layers=2, width=4)) for _ in range(2))
    before = [p.clone() for p in target.parameters()]
    soft_update(target, online, tau)
    for now, old, new in zip(target.parameters(), before, online.parameters(), strict=True):
        np.testing.assert_allclose(now.detach(), ((1 - tau) * old + tau * new).detach(), rtol=1e-5, atol=1e-7)
