"""Encoder `rbf`: (x, n, NN(phi(x))) with phi_c(x) = exp(-0.5 |x - c|^2 / sigma^2) for the centres c of equal cells of the scene."""

import torch
from torch import Tensor, nn

from ...guide_settings import RBF
from . import dense_layers


class RBFEncoder(nn.Module):
    """6 + `features` numbers: x, n, NN(phi(x)). The small network NN is trained; centres and sigma are fixed."""

    horizontal: Tensor
    vertical: Tensor

    def __init__(self, settings: RBF) -> None:
        super().__init__()
        self.sigma = settings.sigma
        self.register_buffer("horizontal", cell_centres(settings.across))
        self.register_buffer("vertical", cell_centres(settings.up))
        self.network = dense_layers(settings.layers_of_its_own())

    def forward(self, x: Tensor, n: Tensor) -> Tensor:
        return torch.cat([x, n, self.network(self.curves(x))], dim=1)

    def curves(self, x: Tensor) -> Tensor:
        """phi_c(x) for every centre c, (batch, up * across * across); the centre's x varies fastest.

        phi_c is computed as a product of one factor per axis, which saves most exponentials.
        """
        along_x, along_y, along_z = (
            (-0.5 * ((coordinate - centres) / self.sigma).square()).exp()
            for coordinate, centres in zip(x.split(1, dim=1), (self.horizontal, self.horizontal, self.vertical), strict=True)
        )
        plane = along_y[:, None, :, None] * along_x[:, None, None, :]
        return (along_z[:, :, None, None] * plane).flatten(1)


def cell_centres(count: int) -> Tensor:
    """The centres of `count` equal parts of [-1, 1]."""
    return (2 * torch.arange(count) + 1) / count - 1


ENCODER = RBFEncoder
