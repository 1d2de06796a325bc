"""Gradients against finite differences, in double precision."""

from collections.abc import Callable, Iterable

import pytest
import torch
from torch import Tensor

from blender_rl_guiding.guiding.dqn import TORCH_THREADS

STEP = 1e-6  # error of a central difference: STEP^2 from truncation, 1e-16 / STEP from rounding
DIRECTIONS = 3


def assert_gradients(loss: Callable[[], Tensor], leaves: Iterable[Tensor]) -> None:
    """For each leaf x and random d: grad loss . d = (loss(x + h d) - loss(x - h d)) / 2h, with h = STEP."""
    torch.set_num_threads(TORCH_THREADS)  # with more threads, waiting would take longer than these small sums
    leaves, random = list(leaves), torch.Generator().manual_seed(5)
    gradients = torch.autograd.grad(loss(), leaves)
    for leaf, gradient in zip(leaves, gradients, strict=True):
        for _ in range(DIRECTIONS):
            direction = torch.randn(leaf.shape, generator=random, dtype=leaf.dtype)
            difference = (_moved(loss, leaf, STEP * direction) - _moved(loss, leaf, -STEP * direction)) / (2 * STEP)
            assert (gradient * direction).sum().item() == pytest.approx(difference, rel=1e-6, abs=1e-8)


@torch.no_grad()
def _moved(loss: Callable[[], Tensor], leaf: Tensor, by: Tensor) -> float:
    before = leaf.clone()
    leaf.add_(by)
    value = loss().item()
    leaf.copy_(before)
    return value
