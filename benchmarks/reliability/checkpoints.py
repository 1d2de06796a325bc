"""Damaged checkpoints: a render goes on from them to the same bits, begins anew, or says one line."""

import io
import random
import time
from pathlib import Path

import numpy as np

from blender_rl_guiding.errors import InputError

from . import mutations, scenes
from .commands import GOES_ON, PATIENCE, Process, called, difference, digest, knows, outcome_of
from .guard import Guard
from .ledger import FoundError

SIZE = 32  # pixels, both ways
OPTIONS = ("--guide", "qtable", "--qtable.cells", 4, "--spp", 40, "--threads", 2)


class Fuzz:
    """See `trying.Trial`."""

    def __init__(self, guard: Guard) -> None:
        if not knows("--checkpoint"):
            raise InputError("this version keeps no checkpoints")
        self._bundle = scenes.saved(guard.tmp, SIZE)
        out, checkpoint = guard.tmp / "killed", guard.tmp / "killed" / "checkpoint.npz"
        status, said = called("render", self._bundle, *OPTIONS, "--out", guard.tmp / "clean")
        assert status == 0, said
        self._clean = digest(guard.tmp / "clean")
        with Process(guard, "render", self._bundle, *OPTIONS, "--checkpoint", 0.01, "--out", out) as process:
            end = time.monotonic() + PATIENCE
            while not checkpoint.exists() and not process.done and time.monotonic() < end:
                time.sleep(0.002)
            process.kill(group=True)
        assert checkpoint.exists(), "the render kept no checkpoint, or ended before it could be killed"
        self._data = checkpoint.read_bytes()
        status, said = called("render", self._bundle, *OPTIONS, "--out", out)
        assert status == 0, said
        assert GOES_ON in said, "the render did not go on from a sound checkpoint"
        assert not difference(digest(out), self._clean)
        with np.load(io.BytesIO(self._data)) as file:
            self._arrays = {name: file[name] for name in file.files}

    def attempt(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        out = folder / "out"
        out.mkdir()
        (out / "checkpoint.npz").write_bytes(self._damaged(rng))
        (folder / "checkpoint.npz").write_bytes((out / "checkpoint.npz").read_bytes())
        result, said = outcome_of(*called("render", self._bundle, *OPTIONS, "--out", out))
        if result == "accepted" and (wrong := difference(digest(out), self._clean)):
            raise FoundError(f"difference: {wrong}")
        return result, said

    def _damaged(self, rng: random.Random) -> bytes:
        kind = rng.choice(("bytes", "zip", "arrays", "arrays"))
        if kind == "bytes":
            return mutations.damaged_bytes(self._data, rng)
        arrays = dict(self._arrays)
        if kind == "arrays":
            name = rng.choice(list(arrays))
            arrays[name] = mutations.damaged_array(arrays[name], rng)
        return mutations.archive(arrays, rng if kind == "zip" else None)
