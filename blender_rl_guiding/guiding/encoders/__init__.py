"""How a surface point is presented to the network, one file an encoder. An encoder maps (x, n) to the network's input."""

from torch import nn

from ...settings import RBF, BSpline, Encoder, Frequency, NoEncoding
from .bspline import BSplineEncoder
from .frequency import FrequencyEncoder
from .none import PlainEncoder
from .rbf import RBFEncoder


def make_encoder(settings: Encoder) -> nn.Module:
    """A module with `.width` that maps x in [-1, 1]^3 and the unit normal n, (batch, 3) each, to (batch, width)."""
    match settings:
        case NoEncoding():
            return PlainEncoder()
        case Frequency():
            return FrequencyEncoder(settings.octaves)
        case RBF():
            return RBFEncoder(settings)
        case BSpline():
            return BSplineEncoder(settings)
