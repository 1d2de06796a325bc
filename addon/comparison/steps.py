"""What a comparison does outside of Blender, step by step: a reference by Cycles if wanted, then the worker's job."""

import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import bpy

from blender_rl_guiding import messages
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.bundle import save
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.typed import MalformedError

from .. import worker_client
from ..another_blender import command
from .running import Status, Steps

_CYCLES = Path(__file__).resolve().parents[1] / "cycles_reference.py"


def working(python: Path, scene: SceneData, job: str, values: dict[str, Any], patience: float, cycles: "Cycles | None" = None) -> Steps:
    """Have the worker do a job about a scene; returns what it tells in `done`, with its notes under "notes".

    Each step waits for at most `patience` seconds. Closed early, nothing that it started goes on.
    """
    status, notes = Status("Starting the renderer", 0.0), []
    with tempfile.TemporaryDirectory(prefix="rl_guided-") as folder, worker_client.borrowed(python) as worker:
        if cycles:
            file = Path(folder, "cycles.exr")
            yield from cycles.render(file, patience)
            values = values | {"reference": {"file": str(file), "about": cycles.about}}
        bundle = Path(folder, f"{scene.name}.npz")
        save(scene, bundle)
        worker.send(job, bundle=str(bundle), **values)
        while True:
            event = worker.event(patience)
            if event["event"] == "done":
                return _outcome(job, event) | {"notes": notes}
            if event["event"] == "status":
                status = Status(event["text"], event["share"])
            elif event["event"] == "pass":
                status = Status(f"Sample {event['samples']}/{event['of']}", event["samples"] / event["of"])
            elif event["event"] == "note":
                notes.append(event["text"])
            yield status


def _outcome(job: str, event: dict[str, Any]) -> dict[str, Any]:
    try:
        messages.check_outcome(job, event)
    except MalformedError as error:
        raise InputError(f"the renderer did not say how it ended: {error}") from error
    return event


class Cycles:
    """A reference by Cycles, rendered by a Blender of its own from a copy of the open file as it is now."""

    def __init__(self, scene: bpy.types.Scene, spp: int) -> None:
        self.about = f"Cycles {bpy.app.version_string}, another renderer; {spp} samples per pixel"
        self._scene, self._spp = scene.name, spp
        self._folder = tempfile.TemporaryDirectory(prefix="rl_guided-cycles-")
        self._file = Path(self._folder.name, "scene.blend")
        try:
            bpy.ops.wm.save_as_mainfile(filepath=str(self._file), copy=True, relative_remap=True, compress=False)
        except RuntimeError as error:
            raise InputError(f"cannot hand the scene to Cycles: {' '.join(str(error).split())}") from error

    def render(self, path: Path, patience: float) -> Iterator[Status]:
        """Render into an EXR file. InputError where Cycles fails."""
        status = Status(f"Reference by Cycles, {self._spp} samples per pixel", 0.0)
        with (
            self._folder,
            tempfile.TemporaryFile("w+", errors="replace") as complaints,  # a pipe that nobody reads would fill up
            _child([str(self._file), self._scene, str(self._spp), str(path)], complaints) as child,
        ):
            while not _ended(child, patience):
                yield status
            if child.returncode or not path.exists():
                complaints.seek(0)
                said = complaints.read().strip().splitlines()
                raise InputError(f"Cycles did not render the reference: {said[-1] if said else _how(child.returncode)}")


@contextmanager
def _child(arguments: list[str], complaints: IO[str]) -> Iterator["subprocess.Popen[bytes]"]:
    """A Blender of this kind without a window, that never outlives the block."""
    whole = [*command(_CYCLES), *arguments]
    null = subprocess.DEVNULL
    try:
        child = subprocess.Popen(whole, stdin=null, stdout=null, stderr=complaints)
    except OSError as error:
        raise InputError(f"cannot start Blender for Cycles, {whole[0]}: {error.strerror or error}") from error
    with child:
        try:
            yield child
        finally:
            child.kill()  # which does nothing to one that has ended


def _ended(child: "subprocess.Popen[bytes]", patience: float) -> bool:
    try:
        child.wait(patience)
    except subprocess.TimeoutExpired:
        return False
    return True


def _how(status: int) -> str:
    return f"it was ended by {signal.Signals(-status).name}" if status < 0 else f"it ended with status {status}"
