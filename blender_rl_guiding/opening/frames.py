"""Exports the frames of an animation one by one, in one Blender, while the caller works on the previous frame."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..children import Child, running
from ..errors import InputError
from ..leftovers import temporary_folder
from ..scene.bundle import load
from ..scene.data import SceneData
from ..scene.view import View
from .blend import Outcome, exporter, failure, outcome_of


class Frames:
    """A Blender that has a file open, and exports its frames."""

    def __init__(self, blend: Path, bundle: Path, child: Child) -> None:
        self._blend, self._bundle, self._child = blend, bundle, child

    def source(self) -> str:
        """The key of the frames: a hash of the file, its referenced files, and the view. Waits until the file is open.

        Has to be called first. InputError if the file cannot be opened, or does not have a name in the view.
        """
        return self._outcome().source

    def ask(self, frame: int) -> None:
        """Begin to export a frame."""
        stdin = self._child.process.stdin
        assert stdin
        with suppress(BrokenPipeError):  # Blender has ended; `take` reports the reason
            os.write(stdin.fileno(), f"{frame}\n".encode())  # unbuffered, because otherwise closing the pipe would write again

    def take(self) -> SceneData:
        """Wait for the requested frame. InputError if it cannot be exported."""
        self._outcome()
        scene = load(self._bundle)
        self._bundle.unlink()
        return scene

    def _outcome(self) -> Outcome:
        assert self._child.process.stdout
        for line in self._child.process.stdout:
            if outcome := outcome_of(line):
                return outcome
        self._child.ended()
        raise failure(self._blend, self._child)


@contextmanager
def exporting_frames(blend: Path, view: View, blender: Path | None = None) -> Iterator[Frames]:
    """Start a Blender that opens a file for its frames. Blender ends with the block. InputError if it cannot start."""
    if blend.suffix != ".blend":
        raise InputError(f"--frames is for .blend files: {blend} is a bundle, of one frame")
    command = exporter(blend, blender)
    with temporary_folder() as folder:
        bundle = Path(folder, f"{blend.stem}.npz")
        arguments = [str(blend.resolve()), str(bundle), "--view", view.to_json(), "--frames"]
        with running([*command, *arguments], stdout=subprocess.PIPE) as child:
            yield Frames(blend, bundle, child)
