"""Opens .blend files: runs the add-on's exporter in a Blender of its own and reads the bundle that it writes."""

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from ..errors import InputError
from .bundle import load
from .data import SceneData
from .description import Loss

_SCRIPT = Path(__file__).resolve().parents[2] / "addon" / "headless.py"
_MAGIC = (b"BLENDER", b"\x28\xb5\x2f\xfd", b"\x1f\x8b")  # plain, zstd, gzip


def open_scene(path: Path, blender: Path | None = None) -> SceneData:
    """Read a bundle, or export a .blend and read that. InputError names what is wrong in one line."""
    if path.suffix != ".blend":
        return load(path)
    with tempfile.TemporaryDirectory() as folder:
        bundle = Path(folder) / f"{path.stem}.npz"
        export(path, bundle, blender=blender)
        return load(bundle)


def export(blend: Path, bundle: Path, *, blender: Path | None = None, strict: bool = False) -> tuple[Loss, ...]:
    """Write the bundle of a .blend, through the bpy module or a Blender executable; returns the coverage report.

    With `strict` a coverage report that is not empty is an InputError, too. On any error `bundle` stays as it was.
    """
    _check(blend)
    command = _command(blender)
    try:
        bundle.parent.mkdir(parents=True, exist_ok=True)
        # A folder for the child to write to, so that nothing remains of it even if it is killed.
        with tempfile.TemporaryDirectory(prefix=".export-", dir=bundle.parent) as folder:
            part = Path(folder).resolve() / bundle.name
            outcome = _run([*command, str(blend.resolve()), str(part), *["--strict"] * strict], blend)
            os.replace(part, bundle)
    except OSError as error:
        raise InputError(f"cannot write {bundle}: {error.strerror or error}") from error
    return tuple(Loss(**loss) for loss in outcome["coverage"])


def _check(blend: Path) -> None:
    try:
        with blend.open("rb") as file:
            start = file.read(7)
    except OSError as error:
        raise InputError(f"cannot read {blend}: {error.strerror or error}") from error
    if not start.startswith(_MAGIC):
        raise InputError(f"{blend} is not a .blend file")


def _command(blender: Path | None) -> list[str]:
    if not _SCRIPT.is_file():
        raise InputError(f"cannot open .blend files: the add-on is not at {_SCRIPT.parent}")
    if blender:
        return [str(blender), "--background", "--factory-startup", "--python-exit-code", "1", "--python", str(_SCRIPT), "--"]
    if importlib.util.find_spec("bpy") is None:
        raise InputError(
            "cannot open .blend files: the bpy module is not installed (./build.sh setup installs it; --blender names a Blender)"
        )
    return [sys.executable, str(_SCRIPT)]


def _run(command: list[str], blend: Path) -> dict[str, Any]:
    """The JSON line of a finished export. The child never outlives this call, whatever interrupts it."""
    try:
        done = subprocess.run(command, capture_output=True, stdin=subprocess.DEVNULL, text=True, errors="replace")
    except OSError as error:
        raise InputError(f"cannot run {command[0]}: {error.strerror or error}") from error
    outcome = _json_line(done.stdout)
    if "error" in outcome:
        raise InputError(outcome["error"])
    if "ok" not in outcome:
        last = (done.stderr.strip() or done.stdout.strip() or "it said nothing").splitlines()[-1]
        raise InputError(f"Blender failed on {blend} with status {done.returncode}: {last}")
    return outcome


def _json_line(text: str) -> dict[str, Any]:
    """The last line of JSON; Blender writes lines of its own before and after it."""
    lines = [line for line in text.splitlines() if line.startswith(('{"ok"', '{"error"'))]
    return json.loads(lines[-1]) if lines else {}
