"""Optimisers and their schedules. torch.optim's would import torch's compiler with it, which takes longer than rendering a small scene."""

import math
from collections.abc import Callable, Iterable
from typing import Protocol

import torch
from torch import Tensor

from ..guide_settings import DQN

_BETA1, _BETA2, _EPSILON = 0.9, 0.999, 1e-8

Schedule = Callable[[int], float]  # the step size of each step, the first being 0


class Optimiser(Protocol):
    """Moves parameters along their gradients."""

    steps: int  # so far

    def step(self) -> None:
        """Move every parameter along its gradient, and drop the gradients."""
        ...

    def tensors(self) -> list[Tensor]:
        """The tensors that it keeps from step to step. Writing to them, and to `steps`, restores it."""
        ...


def make_optimiser(parameters: Iterable[Tensor], settings: DQN) -> Optimiser:
    """The optimiser and schedule that the settings ask for, before the first of at most `max_steps` steps."""
    match settings.optimiser:
        case "adam":
            return Adam(parameters, schedule(settings))
        case "sgd":
            return SGD(parameters, schedule(settings))


def schedule(settings: DQN) -> Schedule:
    """Step sizes from `learning_rate` on, by a factor a step, or by half a cosine that is 0 at `max_steps`."""
    match settings.schedule:
        case "exponential":
            return lambda step: settings.learning_rate * settings.decay**step
        case "cosine":
            return lambda step: settings.learning_rate * (1 + math.cos(math.pi * step / settings.max_steps)) / 2


class SGD:
    """Plain gradient descent, without momentum; equal to torch.optim.SGD."""

    def __init__(self, parameters: Iterable[Tensor], schedule: Schedule) -> None:
        self._parameters, self._schedule = list(parameters), schedule
        self.steps = 0

    def tensors(self) -> list[Tensor]:
        return []

    @torch.no_grad()
    def step(self) -> None:
        rate = self._schedule(self.steps)
        self.steps += 1
        for parameter in self._parameters:
            if parameter.grad is not None:
                parameter.sub_(parameter.grad, alpha=rate)
                parameter.grad = None


class Adam:
    """Kingma and Ba 2015, with their constants; equal to torch.optim.Adam."""

    def __init__(self, parameters: Iterable[Tensor], schedule: Schedule) -> None:
        self._state = [(p, torch.zeros_like(p), torch.zeros_like(p)) for p in parameters]
        self._schedule = schedule
        self.steps = 0

    def tensors(self) -> list[Tensor]:
        return [tensor for _, *moments in self._state for tensor in moments]

    @torch.no_grad()
    def step(self) -> None:
        rate = self._schedule(self.steps)
        self.steps += 1
        rate /= 1 - _BETA1**self.steps
        correction = math.sqrt(1 - _BETA2**self.steps)
        for parameter, first, second in self._state:
            gradient = parameter.grad
            if gradient is not None:
                first.lerp_(gradient, 1 - _BETA1)
                second.mul_(_BETA2).addcmul_(gradient, gradient, value=1 - _BETA2)
                parameter.addcdiv_(first, second.sqrt().div_(correction).add_(_EPSILON), value=-rate)
                parameter.grad = None
