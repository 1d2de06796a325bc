"""How a surface point is presented to the network, one file an encoder. An encoder maps (x, n) to the network's input."""

from importlib import import_module

from torch import nn

from ...guide_settings import EncoderSettings


def make_encoder(settings: EncoderSettings) -> nn.Module:
    """`ENCODER` of the module that bears the kind's name: maps x in [-1, 1]^3 and the unit normal n, (batch, 3) each, to
    (batch, `settings.outputs()`).
    """
    return import_module(f".{settings.kind}", __package__).ENCODER(settings)
