"""What every test may ask for, and the time that compiling takes, kept out of what tests measure."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from blender_rl_guiding.render import warm_up
from blender_rl_guiding.settings import DQN, Machine


@pytest.fixture(scope="session")
def compiled() -> None:
    """Kernels and torch are ready, for this process and those it starts."""
    warm_up(DQN(), Machine())


@pytest.fixture(scope="module")
def own_references(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """References of scenes that exist for one test only do not belong into the user's cache; compiled kernels do."""
    cache = tmp_path_factory.mktemp("cache")
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "blender_rl_guiding"
    (home / "kernels").mkdir(parents=True, exist_ok=True)
    (cache / "blender_rl_guiding").mkdir()
    (cache / "blender_rl_guiding" / "kernels").symlink_to(home / "kernels")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(cache))
        yield
