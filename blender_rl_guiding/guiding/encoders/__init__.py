"""Encoders, one file each. An encoder maps a surface point (x, n) to the network's input."""

from importlib import import_module
from itertools import pairwise

from torch import nn

from ...guide_settings import EncoderSettings


def make_encoder(settings: EncoderSettings) -> nn.Module:
    """The encoder of the settings' kind: `ENCODER` of the module `encoders.<kind>`.

    It maps x in [-1, 1]^3 and the unit normal n, (batch, 3) each, to (batch, `settings.outputs()`).
    """
    return import_module(f".{settings.kind}", __package__).ENCODER(settings)


def dense_layers(widths: tuple[int, ...]) -> nn.Sequential:
    """The small network of an encoder: dense layers; widths[0] is the number of inputs. ReLU between layers, none after the last."""
    first, *others = (nn.Linear(fan_in, fan_out) for fan_in, fan_out in pairwise(widths))
    return nn.Sequential(first, *(module for layer in others for module in (nn.ReLU(), layer)))
