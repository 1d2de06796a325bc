"""The Q network: encoder, dense layers with an activation between, softplus at the end."""

import copy
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from ..guide_settings import DQN
from .encoders import make_encoder

_ACTIVATIONS = {"relu": nn.ReLU, "silu": nn.SiLU, "tanh": nn.Tanh}


class QNetwork(nn.Module):
    """Q(s, a) >= 0 of every patch a: the mean incident radiance through it."""

    def __init__(self, settings: DQN) -> None:
        super().__init__()
        self.encoder = make_encoder(settings.encoder)
        *hidden, self.last = (nn.Linear(fan_in, fan_out) for fan_in, fan_out in pairwise(settings.widths()))
        activation = _ACTIVATIONS[settings.activation]()
        self.hidden = nn.Sequential(*(module for layer in hidden for module in (layer, activation)))

    def forward(self, x: Tensor, n: Tensor) -> Tensor:
        """Q of x in [-1, 1]^3 and unit normals n, (batch, 3) each: (batch, N)."""
        return functional.softplus(self.last(self.hidden(self.encoder(x, n))))

    def of_patch(self, x: Tensor, n: Tensor, patch: Tensor) -> Tensor:
        """Q of one patch for each state, (batch,). The last layer, most of the work, computes this patch alone."""
        weight, bias = functional.embedding(patch, self.last.weight), self.last.bias[patch]
        return functional.softplus((self.hidden(self.encoder(x, n)) * weight).sum(1) + bias)


def target_of(network: QNetwork) -> QNetwork:
    """A copy of the network whose weights have no gradients."""
    return copy.deepcopy(network).requires_grad_(False)


@torch.no_grad()
def soft_update(target: QNetwork, online: QNetwork, tau: float) -> None:
    """target <- (1 - tau) target + tau online."""
    for old, new in zip(target.parameters(), online.parameters(), strict=True):
        old.lerp_(new, tau)
