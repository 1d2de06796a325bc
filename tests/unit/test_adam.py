"""Our Adam against torch's own."""

import torch

from blender_rl_guiding.guiding.adam import Adam


def test_steps_are_those_of_torch():
    torch.manual_seed(1)
    ours, theirs = (torch.nn.Linear(5, 3).double() for _ in range(2))
    theirs.load_state_dict(ours.state_dict())
    adam = Adam(ours.parameters(), 0.05, 0.9)
    other = torch.optim.Adam(theirs.parameters(), 0.05)
    schedule = torch.optim.lr_scheduler.ExponentialLR(other, 0.9)
    start = ours.weight.detach().clone()
    for step in range(20):
        x = torch.randn(7, 5, dtype=torch.float64)
        for network in (ours, theirs):
            (network(x).square() * (1 + step)).mean().backward()
        adam.step()
        other.step()
        schedule.step()
        other.zero_grad()
    assert not torch.allclose(ours.weight, start, atol=0.1)
    torch.testing.assert_close(ours.weight, theirs.weight, rtol=1e-12, atol=1e-14)
    torch.testing.assert_close(ours.bias, theirs.bias, rtol=1e-12, atol=1e-14)
    assert ours.weight.grad is None
