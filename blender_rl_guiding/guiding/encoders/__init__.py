"""How a surface point is presented to the network, one file an encoder. An encoder maps (x, n) to the network's input."""

from torch import nn

from ...settings import Encoder, Frequency, NoEncoding
from .frequency import FrequencyEncoder
from .none import PlainEncoder


def make_encoder(settings: Encoder) -> nn.Module:
    """A module with `.width` that maps x in [-1, 1]^3 and the unit normal n, (batch, 3) each, to (batch, width)."""
    match settings:
        case NoEncoding():
            return PlainEncoder()
        case Frequency():
            return FrequencyEncoder(settings.octaves)
