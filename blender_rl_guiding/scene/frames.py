"""The frames of an animation, exported one by one by one Blender, while something else is done with the one before."""

import os
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from ..errors import InputError
from .blend import Outcome, exporter, failure, outcome_of
from .bundle import load
from .data import SceneData
from .view import View


class Frames:
    """A Blender that has a file open."""

    def __init__(self, blend: Path, folder: Path, child: "subprocess.Popen[str]", complaints: IO[str]) -> None:
        self._blend, self._bundle, self._child, self._complaints = blend, folder / f"{blend.stem}.npz", child, complaints

    def source(self) -> str:
        """What the frames are made of, as a key: the file, what it refers to, and what is taken of it. Waits until it is open.

        The first to be called. InputError where the file cannot be opened or has nothing of that kind.
        """
        return self._outcome().source

    def ask(self, frame: int) -> None:
        """Begin to export a frame."""
        assert self._child.stdin
        with suppress(BrokenPipeError):  # it has ended; `take` tells why
            os.write(self._child.stdin.fileno(), f"{frame}\n".encode())  # unbuffered, or closing the pipe would try again

    def take(self) -> SceneData:
        """Wait for the frame that was asked for. InputError where it cannot be exported."""
        self._outcome()
        scene = load(self._bundle)
        self._bundle.unlink()
        return scene

    def _outcome(self) -> Outcome:
        assert self._child.stdout
        for line in self._child.stdout:
            if outcome := outcome_of(line):
                return outcome
        status = self._child.wait()
        self._complaints.seek(0)
        raise failure(self._blend, status, self._complaints.read().strip())


@contextmanager
def exporting_frames(blend: Path, view: View, blender: Path | None = None) -> Iterator[Frames]:
    """A Blender that opens a file for its frames; it does not outlive the block. InputError where it cannot start."""
    if blend.suffix != ".blend":
        raise InputError(f"--frames is for .blend files: {blend} is a bundle, of one frame")
    command = exporter(blend, blender)
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile("w+", errors="replace") as complaints:
        arguments = [str(blend.resolve()), str(Path(folder, f"{blend.stem}.npz")), "--view", view.to_json(), "--frames"]
        pipe = subprocess.PIPE
        try:
            child = subprocess.Popen([*command, *arguments], stdin=pipe, stdout=pipe, stderr=complaints, text=True, errors="replace")
        except OSError as error:
            raise InputError(f"cannot run {command[0]}: {error.strerror or error}") from error
        with child:
            try:
                yield Frames(blend, Path(folder), child, complaints)
            finally:
                child.kill()  # which does nothing to one that has ended
