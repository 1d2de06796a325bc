"""The losses of `dqn`, as functions of tensors alone."""

import torch
from torch import Tensor

SMALL_Q = 0.01  # added to Q^2 in the divisor of the relative error


def expected_sarsa(reward: Tensor, albedo: Tensor, next_q: Tensor, cosines: Tensor) -> Tensor:
    """r + (2 pi / N) sum_k Q(s', k) albedo / pi cos(theta_k), (batch,).

    reward, albedo: (batch,). next_q: Q(s', k), (batch, N). cosines: the exact mean of cos(theta_k) over each patch, (N,).
    """
    return reward + albedo * (2 / len(cosines)) * (next_q @ cosines)


def mean_loss(q: Tensor, target: Tensor, own_target: Tensor | None = None, relative: bool = False) -> Tensor:
    """The mean over the batch of (Q - target)^2, where Q = Q(s, a; w). All tensors are (batch,).

    own_target: the target computed with w, not w-. Each transition then counts max((Q - target)^2, (Q - own_target)^2), and the gradient
    flows through Q and own_target: C-DQN (Wang and Ueda 2022). relative: divide by Q^2 + 0.01; no gradient flows through the divisor.
    """
    error = (q - target).square()
    if own_target is not None:
        error = torch.maximum(error, (q - own_target).square())
    if relative:
        error = error / (q.detach().square() + SMALL_Q)
    return error.mean()
