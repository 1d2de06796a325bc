"""Encoder `none`: (x, n) as they are."""

import torch
from torch import Tensor, nn

from ...guide_settings import NoEncoding


class PlainEncoder(nn.Module):
    """6 numbers: x, n."""

    def __init__(self, settings: NoEncoding) -> None:
        super().__init__()

    def forward(self, x: Tensor, n: Tensor) -> Tensor:
        return torch.cat([x, n], dim=1)


ENCODER = PlainEncoder
