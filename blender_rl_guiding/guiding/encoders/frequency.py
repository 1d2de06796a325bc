"""Encoder `frequency`: (x, gamma(x), n), gamma(x) = (sin(2^l pi x), cos(2^l pi x)) for l = 0 .. L-1."""

import math

import torch
from torch import Tensor, nn

from ...guide_settings import Frequency


class FrequencyEncoder(nn.Module):
    """6 + 6 L numbers: x, the sines and cosines of each octave, n."""

    def __init__(self, settings: Frequency) -> None:
        super().__init__()
        self.register_buffer("factors", math.pi * 2.0 ** torch.arange(settings.octaves))

    def forward(self, x: Tensor, n: Tensor) -> Tensor:
        angles = (x[:, None, :] * self.factors[:, None]).flatten(1)  # type: ignore[index]  # a buffer is a Tensor
        return torch.cat([x, angles.sin(), angles.cos(), n], dim=1)


ENCODER = FrequencyEncoder
