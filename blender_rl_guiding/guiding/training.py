"""The training of `dqn`: its two networks, their optimiser, and the number of steps."""

import numpy as np
import torch

from ..guide_settings import DQN
from .losses import expected_sarsa, mean_loss
from .network import QNetwork, soft_update, target_of
from .optimisers import make_optimiser
from .patches import mean_cosines
from .replay import Experience
from .saved import Arrays, Saved


class Training:
    """The online network Q(s, a; w), the target network Q(s, a; w-), and the optimiser of w."""

    def __init__(self, settings: DQN) -> None:
        self._settings = settings
        self.online = QNetwork(settings)
        self.target = target_of(self.online)
        self._optimiser = make_optimiser(self.online.parameters(), settings)
        self._cosines = torch.from_numpy(mean_cosines(settings.rows, settings.columns))

    @property
    def steps(self) -> int:
        """Steps so far."""
        return self._optimiser.steps

    def step(self, batch: Experience, scale: float) -> float:
        """Move w by the gradient of `mean_loss`, then w- towards w. Returns the loss. scale: factor on rewards."""
        s = self._settings
        x, n, patch, y, m, reward, albedo = map(torch.from_numpy, batch)
        reward = reward * scale
        q = self.online.of_patch(x, n, patch.long())
        with torch.no_grad():
            target = expected_sarsa(reward, albedo, self.target(y, m), self._cosines)
        own = expected_sarsa(reward, albedo, self.online(y, m), self._cosines) if s.loss == "cdqn" else None
        loss = mean_loss(q, target, own, s.error == "relative")
        loss.backward()
        self._optimiser.step()
        soft_update(self.target, self.online, s.tau)
        return loss.item()

    @torch.no_grad()
    def q(self, x: np.ndarray, n: np.ndarray) -> np.ndarray:
        """Q(s, a; w) of all patches a, in units of scaled rewards: (batch, N) float32."""
        return self.online(torch.from_numpy(x), torch.from_numpy(n)).numpy()

    def state(self) -> Arrays:
        """All that training changes."""
        arrays = {name: tensor.detach().numpy() for name, tensor in self._tensors().items()}
        return arrays | {"steps": np.array(self.steps)}

    @torch.no_grad()
    def restore(self, saved: Saved) -> None:
        """Take a saved `state`. ValueError if training cannot be in it."""
        for name, tensor in self._tensors().items():
            tensor.copy_(torch.from_numpy(saved.array(name, np.float32, *tensor.shape)))
        self._optimiser.steps = saved.whole("steps", 0, self._settings.max_steps)
        if self.steps and not self._settings.first_steps:
            raise ValueError(f"{self.steps} steps of training, where there is none")

    def _tensors(self) -> dict[str, torch.Tensor]:
        kept = {
            "online": self.online.parameters(),
            "target": self.target.parameters(),
            "optimiser": self._optimiser.tensors(),
        }
        return {f"{name}-{k}": tensor for name, tensors in kept.items() for k, tensor in enumerate(tensors)}


def due(settings: DQN, done: int) -> int:
    """Training steps after the next pass, if the replay memory then has enough transitions."""
    return min(settings.steps if done else settings.first_steps, settings.max_steps - done)


def to_come(settings: DQN, done: int, passes: int) -> int:
    """Training steps in the next `passes` passes. Missing steps of the first training are added."""
    return min(max(0, settings.first_steps - done) + passes * settings.steps, settings.max_steps - done)
