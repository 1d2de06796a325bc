"""Adam with a decaying step size. torch.optim's would import torch's compiler with it, which takes longer than rendering a small scene."""

import math
from collections.abc import Iterable

import torch
from torch import Tensor

_BETA1, _BETA2, _EPSILON = 0.9, 0.999, 1e-8


class Adam:
    """Kingma and Ba 2015, with their constants; equal to torch.optim.Adam with an exponential schedule."""

    def __init__(self, parameters: Iterable[Tensor], learning_rate: float, decay: float) -> None:
        self._state = [(p, torch.zeros_like(p), torch.zeros_like(p)) for p in parameters]
        self._rate, self._decay = learning_rate, decay
        self._steps = 0

    @torch.no_grad()
    def step(self) -> None:
        """Move every parameter along its gradient, and drop the gradients."""
        self._steps += 1
        rate = self._rate * self._decay ** (self._steps - 1) / (1 - _BETA1**self._steps)
        correction = math.sqrt(1 - _BETA2**self._steps)
        for parameter, first, second in self._state:
            gradient = parameter.grad
            if gradient is not None:
                first.lerp_(gradient, 1 - _BETA1)
                second.mul_(_BETA2).addcmul_(gradient, gradient, value=1 - _BETA2)
                parameter.addcdiv_(first, second.sqrt().div_(correction).add_(_EPSILON), value=-rate)
                parameter.grad = None
