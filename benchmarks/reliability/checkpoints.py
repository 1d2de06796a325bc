"""Damaged checkpoints: a render goes on to the same bits, begins anew, or fails with one line."""

import io
import random
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from blender_rl_guiding.render import checkpoint

from . import mutations, npz, scenes
from .commands import GOES_ON, called, difference, digest, outcome_of
from .guard import Guard
from .ledger import FoundError

SIZE = 32  # pixels, both ways
OPTIONS = ("--guide", "qtable", "--qtable.cells", 4, "--spp", 40, "--threads", 2)


class Fuzz:
    """See `trying.Trial`."""

    def __init__(self, guard: Guard) -> None:
        self._bundle = scenes.saved(guard.tmp, SIZE)
        out, kept, write = guard.tmp / "again", [], checkpoint._write

        def keep(path: Path, *rest: Any) -> None:
            write(path, *rest)
            kept.append(path.read_bytes())

        with mock.patch.multiple(checkpoint, SHARE=0, _write=keep):  # before each pass
            status, said = called("render", self._bundle, *OPTIONS, "--checkpoint", 0.001, "--out", guard.tmp / "clean")
        assert status == 0, said
        self._clean = digest(guard.tmp / "clean")
        self._data = kept[len(kept) // 2]
        out.mkdir()
        (out / "checkpoint.npz").write_bytes(self._data)
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
            arrays[name] = npz.damaged_array(arrays[name], rng)
        return npz.archive(arrays, rng if kind == "zip" else None)
