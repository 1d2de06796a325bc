"""Fixtures for all tests."""

import fcntl
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from blender_rl_guiding.notices import heard_by
from blender_rl_guiding.render import warm_up
from blender_rl_guiding.settings import DQN, Machine

Once = Callable[[str, Callable[[Path], None]], Path]


@pytest.fixture(scope="session")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> Once:
    """Makes a folder once for all processes of a test run. The first caller fills the folder; the other callers wait, then read it."""
    own = tmp_path_factory.getbasetemp()
    common = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own

    def folder(name: str, make: Callable[[Path], None]) -> Path:
        with (common / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not (common / name).exists():
                part = tmp_path_factory.mktemp(name)
                make(part)
                part.rename(common / name)
        return common / name

    return folder


@pytest.fixture
def notes() -> Iterator[list[str]]:
    """The notices of the test, line by line."""
    lines: list[str] = []
    with heard_by(lines.append):
        yield lines


@pytest.fixture(scope="session")
def compiled() -> None:
    """Compiles kernels and loads torch, for this process and its children."""
    warm_up(DQN(), Machine())


@pytest.fixture(scope="module")
def own_references(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keeps references out of the user's cache. Compiled kernels still go there."""
    cache = tmp_path_factory.mktemp("cache")
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "blender_rl_guiding"
    (home / "kernels").mkdir(parents=True, exist_ok=True)
    (cache / "blender_rl_guiding").mkdir(mode=0o700)
    (cache / "blender_rl_guiding" / "kernels").symlink_to(home / "kernels")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(cache))
        yield
