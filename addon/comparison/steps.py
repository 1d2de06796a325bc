"""Work outside of Blender, step by step: first a reference by Cycles if the user wants it, then a job of the worker."""

from collections.abc import Callable, Generator
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy

from blender_rl_guiding import messages
from blender_rl_guiding.children import running
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.leftovers import temporary_folder
from blender_rl_guiding.pace import Pace
from blender_rl_guiding.scene.bundle import save
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.strings import one_line
from blender_rl_guiding.typed import MalformedError

from .. import worker_client
from ..another_blender import command
from .running import Status, Steps

_CYCLES = Path(__file__).resolve().parents[1] / "cycles_reference.py"


JobOn = Callable[[str], messages.Job]  # makes the job, given the path of the scene's bundle


def working(python: Path, scene: SceneData, job: JobOn, patience: float, cycles: "Cycles | None" = None) -> Steps:
    """Send a job on a scene to the worker. Returns the fields of the event `done`, with the notes as "notes".

    `cycles`: renders the reference first.
    `patience`: the maximal seconds that one step waits.
    If the generator is closed early, it ends all processes that it started.
    """
    status, notes = Status("Starting the renderer", 0.0), []
    with temporary_folder() as folder, worker_client.borrowed(python) as worker:
        bundle = Path(folder, f"{scene.name}.npz")
        asked = job(str(bundle))
        if cycles and isinstance(asked, messages.Compare):
            asked = replace(asked, cycles=(yield from cycles.render(Path(folder, "cycles.exr"), patience)))
        save(scene, bundle)
        worker.send(asked)
        while True:
            event = worker.event(patience)
            if event["event"] == "done":
                return _outcome(messages.name_of(asked), event) | {"notes": notes}
            if event["event"] == "status":
                status = Status(event["text"], event["share"])
            elif event["event"] == "pass":
                status = Status(f"Sample {event['samples']}/{event['of']}", Pace(event["seconds"], event["left"]).share)
            elif event["event"] == "note":
                notes.append(event["text"])
                yield status._replace(note=event["text"])
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
        self._about = f"Cycles {bpy.app.version_string}, another renderer; {spp} samples per pixel"
        self._scene, self._spp = scene.name, spp
        self._folder = temporary_folder()
        self._file = Path(self._folder.name, "scene.blend")
        try:
            bpy.ops.wm.save_as_mainfile(filepath=str(self._file), copy=True, relative_remap=True, compress=False)
        except RuntimeError as error:
            raise InputError(f"cannot hand the scene to Cycles: {one_line(error)}") from error

    def render(self, path: Path, patience: float) -> Generator[Status, None, messages.Reference]:
        """Render into an EXR file. InputError if Cycles fails."""
        status = Status(f"Reference by Cycles, {self._spp} samples per pixel", 0.0)
        with self._folder, running([*command(_CYCLES), str(self._file), self._scene, str(self._spp), str(path)]) as child:
            while not child.ended(patience):
                yield status
            if child.process.returncode or not path.exists():
                raise InputError(f"Cycles did not render the reference: it {child.fate()}")
        return messages.Reference(str(path), self._about)
