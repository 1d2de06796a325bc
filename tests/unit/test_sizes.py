"""The sizes in the panels equal those of the trained network."""

import pytest
import torch
from torch import nn

from blender_rl_guiding.guiding.network import QNetwork
from blender_rl_guiding.settings import DQN, Encoder
from tests import unions

# All numbers are different, so that mixing them up has an effect.
SIZES = {"octaves": 7, "across": 5, "up": 2, "width": 11, "features": 13, "knots": 8, "matrix_columns": 3}


def dense(module: nn.Module) -> tuple[int, ...]:
    """(inputs of the module's first dense layer, then outputs of each dense layer)."""
    layers = [layer for layer in module.modules() if isinstance(layer, nn.Linear)]
    return (*(layer.in_features for layer in layers[:1]), *(layer.out_features for layer in layers))


@pytest.mark.parametrize("layers", [1, 4])
@pytest.mark.parametrize("encoder", unions.every_encoder(SIZES), ids=unions.name)
def test_sizes_are_those_of_the_network(encoder: Encoder, layers: int):
    settings = DQN(encoder=encoder, layers=layers, width=17, rows=3, columns=5)
    network = QNetwork(settings)
    x, n = torch.zeros(2, 3), torch.ones(2, 3)
    assert settings.widths() == (network.encoder(x, n).shape[1], *[17] * (layers - 1), 15)
    assert settings.widths()[1:] == (*dense(network.hidden)[1:], network.last.out_features)
    assert encoder.layers_of_its_own() == dense(network.encoder)
    assert settings.trained() == sum(parameter.numel() for parameter in network.parameters())
