"""Damaged caches: a damaged entry is made again, with the bits of the sound one."""

import json
import os
import random
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from blender_rl_guiding import kernels
from blender_rl_guiding.children import fate
from blender_rl_guiding.experiments.references import reference
from blender_rl_guiding.experiments.truth import kept
from blender_rl_guiding.kernels import source_key
from blender_rl_guiding.scene.bundle import load
from blender_rl_guiding.settings import Machine

from . import mutations, scenes
from .guard import Guard
from .ledger import FoundError

SPP = 256  # two blocks
PIXEL = (4, 6)
KERNELS = 0.1  # share of inputs that are compiled kernels: each starts a process, which may compile for a minute
RENDERS = """
import hashlib, sys
from pathlib import Path
from blender_rl_guiding.render import render
from blender_rl_guiding.scene.bundle import load
from blender_rl_guiding.settings import Machine, Render
print(hashlib.sha256(render(load(Path(sys.argv[1])), Render(spp=2), Machine(threads=2)).image.tobytes()).hexdigest())
"""


class Fuzz:
    """See `trying.Trial`."""

    def __init__(self, guard: Guard) -> None:
        self._guard, self._machine = guard, Machine(threads=2)
        self._bundle = scenes.saved(guard.tmp, scenes.SIZE)
        self._scene, other = load(self._bundle), load(scenes.saved(guard.tmp, scenes.SIZE + 1, "other"))
        self._references = guard.cache / "blender_rl_guiding" / "references"
        self._truth = reference(self._scene, -1, SPP, self._machine)
        reference(other, -1, SPP, self._machine)
        self._copy = guard.tmp / "references"
        shutil.copytree(self._references, self._copy, dirs_exist_ok=True)
        self._probe = guard.tmp / "probe.json"
        kept(self._probe, self._scene, PIXEL, -1, self._machine)
        with guard.unwatched():
            self._bits = self._rendered(guard.cache)

    def attempt(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        if rng.random() < KERNELS:
            return self._of_kernels(rng, folder)
        return self._of_references(rng, folder) if rng.random() < 0.7 else self._of_probe(rng, folder)

    def _of_references(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        shutil.rmtree(self._references)
        shutil.copytree(self._copy, self._references)
        blocks = sorted(path for path in self._references.rglob("*") if path.is_file())
        path = rng.choice(blocks)
        how = damage_file(path, rng, blocks)
        (folder / "damage.txt").write_text(f"{path.name}: {how}")
        if path.is_file():
            shutil.copy(path, folder)
        found = reference(self._scene, -1, SPP, self._machine)
        if not np.array_equal(found, self._truth):
            raise FoundError(f"difference: another reference from a block that was damaged: {how}")
        return "reference", ""

    def _of_probe(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        path, clean = folder / "probe.json", json.loads(self._probe.read_text(encoding="utf-8"))
        path.write_text(mutations.text(mutations.damaged(clean, rng), rng), encoding="utf-8", errors="surrogatepass")
        shutil.copy(path, folder / "damaged.json")
        kept(path, self._scene, PIXEL, -1, self._machine)
        now = json.loads(path.read_text(encoding="utf-8"))
        if now != clean:
            raise FoundError("difference: a damaged probe was kept")
        return "probe", ""

    def _of_kernels(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        own = folder / "cache" / "blender_rl_guiding" / "kernels"
        compiled = self._guard.kernels / source_key(Path(kernels.__file__).parent)
        shutil.copytree(compiled, own / compiled.name)
        files = sorted(path for path in own.rglob("*") if path.is_file())
        path = rng.choice(files)
        how = damage_file(path, rng, files)
        (folder / "damage.txt").write_text(f"{path.relative_to(own)}: {how}")
        with self._guard.unwatched():
            bits = self._rendered(folder / "cache")
        if bits != self._bits:
            raise FoundError(f"difference: damaged kernels ({how}) render {bits}")
        shutil.rmtree(folder / "cache")
        return "kernels", ""

    def _rendered(self, cache: Path) -> str:
        """The SHA-256 of an image rendered by a child process, or how that ended."""
        command, environment = [sys.executable, "-c", RENDERS, str(self._bundle)], os.environ | {"XDG_CACHE_HOME": str(cache)}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, errors="replace")
        return fate(done.returncode, done.stderr.strip()) if done.returncode else done.stdout.strip()


def damage_file(path: Path, rng: random.Random, others: list[Path]) -> str:
    """Damage a file. Returns the way."""
    how = rng.choice(("bytes", "bytes", "bytes", "other", "empty", "folder", "loop"))
    if how == "bytes":
        path.write_bytes(mutations.damaged_bytes(path.read_bytes(), rng))
    elif how == "other":
        path.write_bytes(rng.choice(others).read_bytes())
    else:
        path.unlink()
        {"empty": path.touch, "folder": path.mkdir, "loop": lambda: path.symlink_to(path.name)}[how]()
    return how
