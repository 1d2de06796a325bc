"""The small network that an encoder trains together with the Q network."""

from torch import nn


def three_layers(fan_in: int, width: int, fan_out: int) -> nn.Sequential:
    """Dense fan_in-width-width-fan_out, ReLU between, nothing at the end."""
    return nn.Sequential(nn.Linear(fan_in, width), nn.ReLU(), nn.Linear(width, width), nn.ReLU(), nn.Linear(width, fan_out))
