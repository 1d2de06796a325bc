"""Encoder `bspline`: (x, n, S(x)). Each feature of S is a sum of quadratic B-splines along one axis, with trained weights and knots."""

from itertools import accumulate

import torch
from torch import Tensor, nn
from torch.nn import functional

from ...guide_settings import BSpline
from . import dense_layers

NARROWEST = 1e-3  # smallest width that divides, as a share of the scene's side: softmax can give widths near 0


class BSplineEncoder(nn.Module):
    """6 + 3 s `features` numbers: x, n, and the features of each axis, for each of s columns of the matrix. s = 1 if the small network
    reads the point instead of the matrix.

    A feature is f(u) = sum_i omega_i B2((u - c_i) / delta_i) over k splines, with u in [0, 1] along its axis. The small network's outputs
    give omega by softplus and delta by softmax (sum 1); c_i = delta_1 + ... + delta_(i-1). f(0) = 0, as published.
    """

    def __init__(self, settings: BSpline) -> None:
        super().__init__()
        self.matrix = nn.Parameter(2 * torch.rand(3, settings.matrix_columns) - 1) if settings.reads == "matrix" else None
        self.outputs = (settings.sets(), 2, settings.knots, 3, settings.features)
        self.network = dense_layers(settings.layers_of_its_own())

    def forward(self, x: Tensor, n: Tensor) -> Tensor:
        read = x if self.matrix is None else self.matrix.T
        weights, widths = self.network(read).view(-1, *self.outputs).unbind(2)
        u = ((x + 1) / 2)[:, None, None, :, None]
        features = spline(u, functional.softplus(weights), widths.softmax(2))
        return torch.cat([x, n, features.flatten(1)], dim=1)


def spline(u: Tensor, weights: Tensor, widths: Tensor) -> Tensor:
    """sum_i omega_i B2((u - c_i) / delta_i), with omega = `weights`, delta = `widths` and c_i = delta_1 + ... + delta_(i-1).

    i runs along dimension 2; the other dimensions broadcast. Divisors are at least NARROWEST.
    """
    before = widths.unbind(2)[:-1]
    knots = torch.stack([*accumulate(before, initial=torch.zeros_like(widths[:, :, 0]))], dim=2)  # cumsum's gradient is slower
    return (weights * quadratic((u - knots) / widths.clamp(min=NARROWEST))).sum(2)


def quadratic(t: Tensor) -> Tensor:
    """B2(t): t^2 / 2 on [0, 1), (-2 t^2 + 6 t - 3) / 2 on [1, 2), (3 - t)^2 / 2 on [2, 3), 0 elsewhere."""
    return _Quadratic.apply(t)


class _Quadratic(torch.autograd.Function):
    """B2 with a hand-written derivative: the encoder is a quarter faster than with torch's own."""

    @staticmethod
    def forward(ctx, t: Tensor) -> Tensor:
        """B2(t) = ((3/2 - d)+^2 - 3 (1/2 - d)+^2) / 2, d = |t - 3/2|. For large d both terms are 0, so nothing cancels badly."""
        ctx.save_for_backward(t)
        d = (t - 1.5).abs_()
        outer = (1.5 - d).relu_().square_()
        inner = d.neg_().add_(0.5).relu_().square_()
        return outer.sub_(inner, alpha=3).mul_(0.5)

    @staticmethod
    def backward(ctx, *gradients: Tensor) -> Tensor:
        """B2'(t) = hat(t) - hat(t - 1), hat(t) = (1 - |t - 1|)+."""
        (t,), (gradient,) = ctx.saved_tensors, gradients
        rising, falling = ((t - middle).abs_().neg_().add_(1).relu_() for middle in (1, 2))
        return rising.sub_(falling).mul_(gradient)


ENCODER = BSplineEncoder
