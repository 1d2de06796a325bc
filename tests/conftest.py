"""What every test may ask for, and the time that compiling takes, kept out of what tests measure."""

import pytest

from blender_rl_guiding.render import warm_up
from blender_rl_guiding.settings import DQN, Machine


@pytest.fixture(scope="session")
def compiled() -> None:
    """Kernels and torch are ready, for this process and those it starts."""
    warm_up(DQN(), Machine())
