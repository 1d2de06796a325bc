"""The Q network: encoder, dense layers with ReLU between, softplus at the end."""

import copy
from itertools import pairwise

import torch
from torch import Tensor, nn

from ..settings import DQN
from .encoders import make_encoder


class QNetwork(nn.Module):
    """Q(s, a) >= 0 of every patch a: the mean incident radiance through it."""

    def __init__(self, settings: DQN) -> None:
        super().__init__()
        self.encoder = make_encoder(settings.encoder)
        widths = [self.encoder.width, *[settings.width] * (settings.layers - 1), settings.rows * settings.columns]
        dense = [nn.Linear(fan_in, fan_out) for fan_in, fan_out in pairwise(widths)]
        self.dense = nn.Sequential(*(module for layer in dense[:-1] for module in (layer, nn.ReLU())), dense[-1], nn.Softplus())

    def forward(self, x: Tensor, n: Tensor) -> Tensor:
        """Q of x in [-1, 1]^3 and unit normals n, (batch, 3) each: (batch, N)."""
        return self.dense(self.encoder(x, n))


def target_of(network: QNetwork) -> QNetwork:
    """A copy that no gradient reaches."""
    target = copy.deepcopy(network)
    return target.requires_grad_(False)


@torch.no_grad()
def soft_update(target: QNetwork, online: QNetwork, tau: float) -> None:
    """target <- (1 - tau) target + tau online."""
    for old, new in zip(target.parameters(), online.parameters(), strict=True):
        old.lerp_(new, tau)
