"""The command line: in this process, in a child process as for a user, and interrupted at a chosen moment."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from blender_rl_guiding.doors import cli
from blender_rl_guiding.scene.bundle import save
from tests import scenes
from tests.patience import PATIENCE

ROOT = Path(__file__).resolve().parents[2]

# Runs `rlg`, and prints a line when it reaches a function. This is the process of the command, so signals reach only the command.
TELLING = """
import importlib, sys
from blender_rl_guiding.doors import cli
module, owner, name = sys.argv[1].split(":")
place = importlib.import_module("blender_rl_guiding." + module)
place = getattr(place, owner) if owner else place
real = getattr(place, name)
def told(*args, **kwargs):
    print("now", flush=True)
    return real(*args, **kwargs)
setattr(place, name, told)
del sys.argv[1]
sys.exit(cli.main())
"""


@pytest.fixture
def bundle(tmp_path: Path) -> Path:
    """A tiny scene."""
    save(scenes.tiny(12), tmp_path / "tiny.npz")
    return tmp_path / "tiny.npz"


@pytest.fixture(scope="module", autouse=True)
def _own_references(own_references: None) -> None:
    """Keeps references out of the user's cache, in all tests of this folder."""


Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def rlg(compiled: None, capsys: pytest.CaptureFixture[str]) -> Run:
    """Run `rlg` with arguments in this process. A new process would have to load Numba, torch and the kernels again."""

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        capsys.readouterr()
        status = cli.main([*map(str, arguments)])
        said = capsys.readouterr()
        return subprocess.CompletedProcess(arguments, status, said.out, said.err)

    return run


@pytest.fixture
def rlg_process(compiled: None) -> Run:
    """Run `rlg` with arguments in a child process."""

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        command = [
            sys.executable,
            "-c",
            "import sys; from blender_rl_guiding.doors.cli import main; sys.exit(main())",
            *map(str, arguments),
        ]
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE)

    return run


@pytest.fixture
def interrupted(compiled: None) -> Callable[..., tuple[int, str]]:
    """Run `rlg` with arguments; send SIGINT when it reaches `moment` ("module:class:function") for the `nth` time.

    Waits until `rlg` and all its children have ended. Returns (status, stderr of all of them). group: send SIGINT to the children, too,
    like a terminal.
    """

    def run(moment: str, nth: int, *arguments: object, after: float = 0.05, group: bool = False) -> tuple[int, str]:
        command, pipe = [sys.executable, "-c", TELLING, moment, *map(str, arguments)], subprocess.PIPE
        with subprocess.Popen(command, cwd=ROOT, stdout=pipe, stderr=pipe, text=True, start_new_session=group) as process:
            assert process.stdout
            seen = 0
            while seen < nth:
                line = process.stdout.readline()
                assert line, f"ended before {moment}: {process.stderr.read() if process.stderr else ''}"
                seen += line == "now\n"
            time.sleep(after)
            if group:
                os.killpg(process.pid, signal.SIGINT)
            else:
                process.send_signal(signal.SIGINT)
            _, said = process.communicate(timeout=PATIENCE)
            return process.returncode, said

    return run
