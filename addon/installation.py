"""The renderer's Python environment, seen from Blender: the path of its Python, and its missing libraries.

This module installs nothing. It names each missing part and the command that installs it.
"""

import re
import tempfile
import time
from contextlib import ExitStack, suppress
from pathlib import Path

import bpy

from blender_rl_guiding import __version__
from blender_rl_guiding.children import Child, running
from blender_rl_guiding.environment import PACKAGE, Part, find
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.typed import MalformedError, parse, read

SETUP = "./build.sh setup"
CHOOSE = f"run {SETUP} in the project, or choose its Python in Preferences > Add-ons > RL Guided"
PATIENCE = 120.0  # seconds; a cold disk may need one minute for torch


def python() -> Path:
    """The Python that the user chose, otherwise the one that was set up last. Without either, InputError with a solution."""
    if chosen := _preference():
        if not chosen.is_file():
            raise InputError(f"the renderer's Python is not at {chosen}: {CHOOSE}")
        return chosen
    found = find()
    if found is None:
        raise InputError(f"no renderer environment: {CHOOSE}")
    if not found.is_file():
        raise InputError(f"the renderer environment is gone, no {found}: {CHOOSE}")
    return found


def _preference() -> Path | None:
    """The user's choice, if any. The add-on has no preferences when it runs from the source tree."""
    entry = bpy.context.preferences.addons.get(__package__)
    chosen = entry.preferences.python if entry and entry.preferences else ""
    return Path(bpy.path.abspath(chosen)).expanduser() if chosen else None


def check() -> list[Part]:
    """The parts of the environment; a faulty part has a `problem`. Blocks for about three seconds; `Check` does not block."""
    return Check().parts()


class Check:
    """A running check, in a separate process."""

    def __init__(self) -> None:
        self._parts: list[Part] = []
        self._child: Child | None = None
        self._end, self._ends = time.monotonic() + PATIENCE, ExitStack()
        try:
            self._python = python()
        except InputError as error:
            self._parts = [Part("Environment", "", str(error), SETUP)]
            return
        file = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115  # as long as the child
        self._said = self._ends.enter_context(file)
        # Isolated (-I): neither the current folder nor variables for another Python may change the imports.
        command = [str(self._python), "-I", "-m", f"{PACKAGE}.environment", __version__]
        try:
            self._child = self._ends.enter_context(running(command, self._said.fileno()))
        except InputError as error:
            self._parts = [Part("Environment", "", f"{error}; {CHOOSE}", SETUP)]
            self._ends.close()

    def done(self) -> bool:
        """Whether `parts` returns at once."""
        return self._child is None or self._child.ended(0.0) or time.monotonic() > self._end

    def parts(self) -> list[Part]:
        """Waits for the parts, at most until `PATIENCE` seconds after the start, and returns them."""
        if self._child:
            if not self._child.ended(max(0.0, self._end - time.monotonic())):
                self._child.process.kill()
                self._child.ended()
            self._said.seek(0)
            self._parts = _read(self._said.read(), self._child.complaints(), self._child.process.returncode, self._python)
            self.stop()
        return self._parts

    def stop(self) -> None:
        """End the child and forget it."""
        self._ends.close()
        self._child = None


def _read(said: str, complained: str, status: int, python: Path) -> list[Part]:
    """The parts that the child has listed. If the child failed, one part with the reason."""
    for line in said.splitlines():
        if line.startswith("[{"):
            # An environment of another version may send other fields. With `loose` we can still read its version.
            with suppress(MalformedError):
                return list(read(tuple[Part, ...], parse(line), "the environment", loose=True))
    last = (complained or "it said nothing").splitlines()[-1]
    if found := re.fullmatch(r"loading (\S+) (\S+)", last):
        return [Part(found[1], found[2], f"ends Python with status {status} when it is loaded", f"{SETUP} {found[1]}")]
    return [Part("Environment", "", f"{python} cannot render (status {status}): {last}", SETUP)]
