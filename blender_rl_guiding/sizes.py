"""How large a Q network is, without building it: for panels, which run where there is no torch."""

from dataclasses import dataclass
from itertools import pairwise

from .settings import DQN, RBF, BSpline, Encoder, Frequency, NoEncoding


@dataclass(frozen=True)
class Sizes:
    """The numbers that enter a network, and those that leave each of its dense layers."""

    widths: tuple[int, ...]  # of the Q network: first what it reads, last the patches
    encoder: tuple[int, ...]  # of the encoder's own network; empty where it has none
    parameters: int  # trained ones of both


def sizes(settings: DQN) -> Sizes:
    """The sizes of the network that `guiding.network.QNetwork` makes of such settings."""
    encoder, inputs, further = _encoder(settings.encoder)
    widths = (inputs, *[settings.width] * (settings.layers - 1), settings.rows * settings.columns)
    return Sizes(widths, encoder, _parameters(widths) + _parameters(encoder) + further)


def _encoder(settings: Encoder) -> tuple[tuple[int, ...], int, int]:
    """Widths of the encoder's own network, how many numbers the Q network reads, and trained numbers outside of layers."""
    match settings:
        case NoEncoding():
            return (), 6, 0
        case Frequency():
            return (), 6 + 6 * settings.octaves, 0
        case RBF():
            layers = settings.across**2 * settings.up, settings.width, settings.width, settings.features
            return layers, 6 + settings.features, 0
        case BSpline():
            columns = settings.matrix_columns if settings.reads == "matrix" else 0
            layers = 3, settings.width, settings.width, 2 * settings.knots * 3 * settings.features
            return layers, 6 + 3 * settings.features * max(columns, 1), 3 * columns


def _parameters(widths: tuple[int, ...]) -> int:
    """Weights and biases of dense layers."""
    return sum((fan_in + 1) * fan_out for fan_in, fan_out in pairwise(widths))
