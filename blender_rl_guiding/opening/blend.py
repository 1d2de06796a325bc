"""Opens .blend files: runs the add-on's exporter in a separate Blender, and reads the bundle that the exporter writes."""

import importlib.util
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ..children import Child, running
from ..errors import InputError, trying_to
from ..leftovers import temporary_folder
from ..scene.bundle import load
from ..scene.data import SceneData
from ..scene.description import Loss
from ..scene.view import View
from ..typed import MalformedError, parse, read

_SCRIPT = Path(__file__).resolve().parents[2] / "addon" / "headless.py"
_MAGIC = (b"BLENDER", b"\x28\xb5\x2f\xfd", b"\x1f\x8b")  # plain, zstd, gzip


def open_scene(path: Path, blender: Path | None = None, view: View = View()) -> SceneData:
    """Read a bundle, or export a .blend and read its bundle. The InputError names the fault in one line."""
    with opening(path, blender, view) as opened:
        return opened()


@contextmanager
def opening(path: Path, blender: Path | None = None, view: View = View()) -> Iterator[Callable[[], SceneData]]:
    """As `open_scene`, but Blender exports in the background: yields a function that waits for the scene.

    The function raises InputError. A fault that is detected without Blender raises InputError at once. After the block all files of the
    export are removed.
    """
    if path.suffix != ".blend":
        view.check_none(path)
        scene = load(path)
        yield lambda: scene
        return
    command = exporter(path, blender)
    with temporary_folder() as folder:
        bundle = Path(folder, f"{path.stem}.npz")
        with _exporting(command, path, bundle, view) as finish:

            def opened() -> SceneData:
                finish()
                return load(bundle)

            yield opened


def export(blend: Path, bundle: Path, *, blender: Path | None = None, strict: bool = False, view: View = View()) -> tuple[Loss, ...]:
    """Write the bundle of a .blend, through the bpy module or a Blender executable; returns the coverage report.

    With `strict`, InputError if the coverage report is not empty. On any error the file `bundle` stays unchanged.
    """
    command = exporter(blend, blender)
    options = ["--strict"] if strict else []
    with trying_to(f"write {bundle}"):
        bundle.parent.mkdir(parents=True, exist_ok=True)
        # The child writes to a temporary folder. So no file remains, even if the child is killed.
        with temporary_folder(bundle.parent) as folder:
            part = Path(folder).resolve() / bundle.name
            with _exporting(command, blend, part, view, *options) as finish:
                coverage = finish()
            os.replace(part, bundle)
    return coverage


def _check(blend: Path) -> None:
    with trying_to(f"read {blend}"), blend.open("rb") as file:
        start = file.read(7)
    if not start.startswith(_MAGIC):
        raise InputError(f"{blend} is not a .blend file")


def exporter(blend: Path, blender: Path | None) -> list[str]:
    """The command that starts the exporter. InputError if it could not open the file: no .blend, no add-on or no bpy."""
    _check(blend)
    if not _SCRIPT.is_file():
        raise InputError(f"cannot open .blend files: the add-on is not at {_SCRIPT.parent}")
    if blender:
        return [str(blender), "--background", "--factory-startup", "--python-exit-code", "1", "--python", str(_SCRIPT), "--"]
    if importlib.util.find_spec("bpy") is None:
        raise InputError(
            "cannot open .blend files: the bpy module is not installed (./build.sh setup installs it; --blender names a Blender)"
        )
    return [sys.executable, str(_SCRIPT)]


@contextmanager
def _exporting(command: list[str], blend: Path, bundle: Path, view: View, *options: str) -> Iterator[Callable[[], tuple[Loss, ...]]]:
    """Start a child that exports; yields a function that waits for it and returns the coverage report. The child ends with the block."""
    arguments = [*command, str(blend.resolve()), str(bundle), "--view", view.to_json(), "--held", *options]
    with running(arguments, stdout=subprocess.PIPE) as child:
        yield lambda: _coverage(child, blend)


def _coverage(child: Child, blend: Path) -> tuple[Loss, ...]:
    """Wait for the export, and return the coverage report of its JSON line. InputError if it failed."""
    assert child.process.stdout
    said = child.process.stdout.read()
    child.ended()
    outcome = next((found for line in reversed(said.splitlines()) if (found := outcome_of(line))), None)
    if outcome is None:
        raise failure(blend, child, said)
    return outcome.coverage


@dataclass(frozen=True)
class Outcome:
    """The exporter's answer."""

    ok: str = ""  # the bundle
    error: str = ""  # one line; empty on success
    coverage: tuple[Loss, ...] = ()
    source: str = ""  # only for animations: the key of the file and view of its frames, see `frames`


def outcome_of(line: str) -> Outcome | None:
    """The exporter's answer in a line; None for Blender's own output. InputError if the answer is an error."""
    if not line.startswith(('{"ok"', '{"error"')):
        return None
    try:
        outcome: Outcome = read(Outcome, parse(line), "the exporter's answer", loose=True)
    except MalformedError as error:
        raise InputError(f"cannot read the exporter's answer: {error}") from error
    if outcome.error:
        raise InputError(outcome.error)
    return outcome


def failure(blend: Path, child: Child, said: str = "") -> InputError:
    """The error of an exporter that ended without an answer."""
    return InputError(f"Blender failed on {blend}: it {child.fate(said)}")
