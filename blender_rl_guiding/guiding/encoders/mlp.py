"""The small network that an encoder trains together with the Q network."""

from itertools import pairwise

from torch import nn


def dense_layers(widths: tuple[int, ...]) -> nn.Sequential:
    """Dense layers of these widths, the first of what enters; ReLU between, nothing at the end."""
    first, *others = (nn.Linear(fan_in, fan_out) for fan_in, fan_out in pairwise(widths))
    return nn.Sequential(first, *(module for layer in others for module in (nn.ReLU(), layer)))
