"""The add-on finds the renderer's Python and shows the missing parts, whatever this Python is or does."""

import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

from addon import installation as environment
from addon import preferences
from addon.installation import CHOOSE, SETUP
from addon.preferences import RLG_OT_check_environment
from blender_rl_guiding.environment import Part, announce, pointer
from blender_rl_guiding.errors import InputError

WHOLE = Part("torch", "2.0")
BROKEN = Part("numba", "0.6", "does not load: no LLVM", "./build.sh setup numba")


@pytest.fixture(autouse=True)
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A data folder without an announced environment."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))


@pytest.fixture
def choose(monkeypatch: pytest.MonkeyPatch):
    """Sets the preference with the path of the Python. Only an installed add-on has this preference."""

    def set_to(path: str) -> None:
        entry = SimpleNamespace(preferences=SimpleNamespace(python=path))
        context = SimpleNamespace(preferences=SimpleNamespace(addons={"addon": entry}))
        monkeypatch.setattr(environment, "bpy", SimpleNamespace(context=context, path=bpy.path))

    return set_to


def point_to(path: Path, script: str = "") -> Path:
    """Write the path of a stand-in for a Python where the add-on looks for it."""
    if script:
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)
    pointer().parent.mkdir(parents=True, exist_ok=True)
    pointer().write_text(f"{path}\n")
    return path


def says(*parts: Part) -> str:
    return f"echo noise; cat <<'END'\n{json.dumps([asdict(part) for part in parts])}\nEND"


def test_the_chosen_python_comes_before_the_announced(tmp_path: Path, choose):
    with pytest.raises(InputError, match=r"^no renderer environment: run \./build\.sh setup in the project, or choose its Python in"):
        environment.python()
    announce()
    assert environment.python() == Path(sys.executable)
    choose(str(point_to(tmp_path / "mine", "true")))
    announce()
    assert environment.python() == tmp_path / "mine"
    choose("")
    assert environment.python() == Path(sys.executable)


def test_an_environment_that_is_gone(tmp_path: Path, choose):
    point_to(tmp_path / "gone")
    with pytest.raises(InputError) as caught:
        environment.python()
    assert str(caught.value) == f"the renderer environment is gone, no {tmp_path}/gone: {CHOOSE}"
    choose(str(tmp_path))
    with pytest.raises(InputError) as caught:
        environment.python()
    assert str(caught.value) == f"the renderer's Python is not at {tmp_path}: {CHOOSE}"
    assert environment.check() == [Part("Environment", "", str(caught.value), SETUP)]


def test_what_the_environment_says_is_shown(tmp_path: Path):
    point_to(tmp_path / "python", says(WHOLE, BROKEN))
    assert environment.check() == [WHOLE, BROKEN]


def test_an_environment_of_another_version_may_say_more_or_less(tmp_path: Path):
    point_to(tmp_path / "python", """echo '[{"name": "torch", "version": "3.0", "size": 7}]'""")
    assert environment.check() == [Part("torch", "3.0")]


@pytest.mark.parametrize(
    ("script", "reason"),
    [
        ("echo boom >&2; exit 3", "cannot render (status 3): boom"),
        ("true", "cannot render (status 0): it said nothing"),
        (f'exec {sys.executable} -S "$@"', f"cannot render (status 1): {sys.executable}: Error while finding module specification for"),
    ],
)
def test_pythons_that_cannot_answer(tmp_path: Path, script: str, reason: str):
    point_to(tmp_path / "python", script)
    (fault,) = environment.check()
    assert fault.problem.startswith(f"{tmp_path}/python {reason}")
    assert fault.command == SETUP


def test_a_library_that_ends_python(tmp_path: Path):
    point_to(tmp_path / "python", "echo loading torch 2.0 >&2; kill -ILL $$")
    assert environment.check() == [Part("torch", "2.0", "ends Python with status -4 when it is loaded", "./build.sh setup torch")]


def test_what_is_no_program(tmp_path: Path):
    point_to(tmp_path / "python").touch()
    (fault,) = environment.check()
    assert fault.problem == f"cannot run {tmp_path}/python: Permission denied; {CHOOSE}"


def test_one_that_hangs_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(environment, "PATIENCE", 0.2)
    point_to(tmp_path / "python", "exec sleep 60")
    (fault,) = environment.check()
    assert fault.problem == f"{tmp_path}/python cannot render (status -9): it said nothing"
    running = environment.Check()
    while not running.done():
        time.sleep(0.02)
    assert running.parts() == [fault]


def test_the_window_does_not_wait(exported: list, tmp_path: Path):
    """Start the check like the button, then call the timer's function by hand."""
    point_to(tmp_path / "python", f"while [ ! -e {tmp_path}/go ]; do sleep 0.02; done; {says(WHOLE)}")
    preferences.start()
    try:
        assert preferences.poll() == preferences.INTERVAL
        assert not RLG_OT_check_environment.parts
        (tmp_path / "go").touch()
        while preferences.poll():
            time.sleep(0.02)
        assert RLG_OT_check_environment.parts == (WHOLE,)
    finally:
        preferences.forget()
    assert (RLG_OT_check_environment.running, RLG_OT_check_environment.parts) == (None, ())


def test_a_check_under_way_ends_with_the_addon(exported: list, tmp_path: Path):
    point_to(tmp_path / "python", "exec sleep 60")
    preferences.start()
    running = RLG_OT_check_environment.running
    assert running
    preferences.unregister()
    preferences.register()
    assert running.done()
    assert not bpy.app.timers.is_registered(preferences.poll)


def test_a_script_has_the_answer_when_the_call_returns(exported: list, tmp_path: Path):
    point_to(tmp_path / "python", says(WHOLE, BROKEN))
    assert bpy.ops.rl_guided.check_environment() == {"FINISHED"}
    assert RLG_OT_check_environment.parts == (WHOLE, BROKEN)
    preferences.forget()
