"""How a surface point is presented to the network, one file an encoder. An encoder maps (x, n) to the network's input."""

from importlib import import_module
from itertools import pairwise

from torch import nn

from ...guide_settings import EncoderSettings


def make_encoder(settings: EncoderSettings) -> nn.Module:
    """`ENCODER` of the module that bears the kind's name: maps x in [-1, 1]^3 and the unit normal n, (batch, 3) each, to
    (batch, `settings.outputs()`).
    """
    return import_module(f".{settings.kind}", __package__).ENCODER(settings)


def dense_layers(widths: tuple[int, ...]) -> nn.Sequential:
    """The dense layers of an encoder's own: the first width is that of what enters; ReLU between, nothing at the end."""
    first, *others = (nn.Linear(fan_in, fan_out) for fan_in, fan_out in pairwise(widths))
    return nn.Sequential(first, *(module for layer in others for module in (nn.ReLU(), layer)))
