"""Optimisers and their schedules.

torch.optim is not used: it imports torch's compiler, which takes longer than rendering a small scene.
"""

import math
from collections.abc import Callable, Iterable

import torch
from torch import Tensor

from ..guide_settings import DQN

_BETA1, _BETA2, _EPSILON = 0.9, 0.999, 1e-8

Schedule = Callable[[int], float]  # from the number of a step, beginning with 0, to its step size


class Optimiser:
    """Moves parameters along their gradients."""

    def __init__(self, parameters: Iterable[Tensor], schedule: Schedule) -> None:
        self._parameters, self._schedule = list(parameters), schedule
        self.steps = 0

    def tensors(self) -> list[Tensor]:
        """The tensors that the optimiser keeps from step to step. Writing to them and to `steps` restores the optimiser."""
        return []

    @torch.no_grad()
    def step(self) -> None:
        """Move every parameter along its gradient, and drop the gradients."""
        rate = self._schedule(self.steps)
        self.steps += 1
        for k, parameter in enumerate(self._parameters):
            if parameter.grad is not None:
                self._move(k, parameter, parameter.grad, rate)
                parameter.grad = None

    def _move(self, k: int, parameter: Tensor, gradient: Tensor, rate: float) -> None:
        """Move parameter k."""
        raise NotImplementedError


def make_optimiser(parameters: Iterable[Tensor], settings: DQN) -> Optimiser:
    """The optimiser and schedule that the settings ask for, before the first of at most `max_steps` steps."""
    match settings.optimiser:
        case "adam":
            return Adam(parameters, schedule(settings))
        case "sgd":
            return SGD(parameters, schedule(settings))


def schedule(settings: DQN) -> Schedule:
    """Step sizes that begin at `learning_rate`. They fall by a factor at each step, or as half a cosine that is 0 at `max_steps`."""
    match settings.schedule:
        case "exponential":
            return lambda step: settings.learning_rate * settings.decay**step
        case "cosine":
            return lambda step: settings.learning_rate * (1 + math.cos(math.pi * step / settings.max_steps)) / 2


class SGD(Optimiser):
    """Plain gradient descent, without momentum; equal to torch.optim.SGD."""

    def _move(self, k: int, parameter: Tensor, gradient: Tensor, rate: float) -> None:
        parameter.sub_(gradient, alpha=rate)


class Adam(Optimiser):
    """Kingma and Ba 2015, with their constants; equal to torch.optim.Adam."""

    def __init__(self, parameters: Iterable[Tensor], schedule: Schedule) -> None:
        super().__init__(parameters, schedule)
        self._moments = [(torch.zeros_like(p), torch.zeros_like(p)) for p in self._parameters]

    def tensors(self) -> list[Tensor]:
        return [tensor for moments in self._moments for tensor in moments]

    def _move(self, k: int, parameter: Tensor, gradient: Tensor, rate: float) -> None:
        first, second = self._moments[k]
        first.lerp_(gradient, 1 - _BETA1)
        second.mul_(_BETA2).addcmul_(gradient, gradient, value=1 - _BETA2)
        correction = math.sqrt(1 - _BETA2**self.steps)
        step = rate / (1 - _BETA1**self.steps)
        parameter.addcdiv_(first, second.sqrt().div_(correction).add_(_EPSILON), value=-step)
