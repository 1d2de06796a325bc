"""The frames of an animation, exported one by one by one Blender, while something else is done with the one before."""

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
    """A Blender that has a file open."""

    def __init__(self, blend: Path, bundle: Path, child: Child) -> None:
        self._blend, self._bundle, self._child = blend, bundle, child

    def source(self) -> str:
        """What the frames are made of, as a key: the file, what it refers to, and what is taken of it. Waits until it is open.

        The first to be called. InputError where the file cannot be opened or has nothing of that kind.
        """
        return self._outcome().source

    def ask(self, frame: int) -> None:
        """Begin to export a frame."""
        stdin = self._child.process.stdin
        assert stdin
        with suppress(BrokenPipeError):  # it has ended; `take` tells why
            os.write(stdin.fileno(), f"{frame}\n".encode())  # unbuffered, or closing the pipe would try again

    def take(self) -> SceneData:
        """Wait for the frame that was asked for. InputError where it cannot be exported."""
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
    """A Blender that opens a file for its frames; it does not outlive the block. InputError where it cannot start."""
    if blend.suffix != ".blend":
        raise InputError(f"--frames is for .blend files: {blend} is a bundle, of one frame")
    command = exporter(blend, blender)
    with temporary_folder() as folder:
        bundle = Path(folder, f"{blend.stem}.npz")
        arguments = [str(blend.resolve()), str(bundle), "--view", view.to_json(), "--frames"]
        with running([*command, *arguments], stdout=subprocess.PIPE) as child:
            yield Frames(blend, bundle, child)
