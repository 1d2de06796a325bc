"""Our optimisers and schedules equal those of torch."""

import pytest
import torch
from torch.optim import SGD, Adam
from torch.optim.lr_scheduler import CosineAnnealingLR, ExponentialLR

from blender_rl_guiding.guiding.optimisers import make_optimiser, schedule
from blender_rl_guiding.settings import DQN

STEPS = 20
THEIR_OPTIMISERS = {"adam": Adam, "sgd": SGD}
THEIR_SCHEDULES = {"exponential": lambda other: ExponentialLR(other, 0.9), "cosine": lambda other: CosineAnnealingLR(other, STEPS)}


@pytest.mark.parametrize("schedule", THEIR_SCHEDULES)
@pytest.mark.parametrize("optimiser", THEIR_OPTIMISERS)
def test_steps_are_those_of_torch(optimiser, schedule):
    torch.manual_seed(1)
    ours, theirs = (torch.nn.Linear(5, 3).double() for _ in range(2))
    theirs.load_state_dict(ours.state_dict())
    settings = DQN(optimiser=optimiser, schedule=schedule, learning_rate=0.05, decay=0.9, max_steps=STEPS)
    one, other = make_optimiser(ours.parameters(), settings), THEIR_OPTIMISERS[optimiser](theirs.parameters(), 0.05)
    their_schedule = THEIR_SCHEDULES[schedule](other)
    start = ours.weight.detach().clone()
    for step in range(STEPS):
        x = torch.randn(7, 5, dtype=torch.float64)
        for network in (ours, theirs):
            (network(x).square() * (1 + step)).mean().backward()
        one.step()
        other.step()
        their_schedule.step()
        other.zero_grad()
    assert not torch.allclose(ours.weight, start, atol=0.1)
    torch.testing.assert_close(ours.weight, theirs.weight, rtol=1e-12, atol=1e-14)
    torch.testing.assert_close(ours.bias, theirs.bias, rtol=1e-12, atol=1e-14)
    assert ours.weight.grad is None


@pytest.mark.parametrize("optimiser", THEIR_OPTIMISERS)
def test_a_parameter_without_gradient_stays(optimiser):
    still, moved = (torch.nn.Parameter(torch.ones(3)) for _ in range(2))
    moved.square().sum().backward()
    make_optimiser([still, moved], DQN(optimiser=optimiser)).step()
    assert torch.equal(still, torch.ones(3))
    assert not torch.equal(moved, torch.ones(3))


def test_ends_of_the_schedules():
    cosine = schedule(DQN(schedule="cosine", learning_rate=0.3, max_steps=10))
    assert [cosine(0), cosine(5), cosine(10)] == pytest.approx([0.3, 0.15, 0], abs=1e-15)
    exponential = schedule(DQN(schedule="exponential", learning_rate=0.3, decay=0.5))
    assert [exponential(0), exponential(3)] == pytest.approx([0.3, 0.3 / 8])
