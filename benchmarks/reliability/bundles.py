"""Damaged bundles go through the loader and through the stage that is built of them; some are rendered."""

import json
import random
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from blender_rl_guiding.scene.bundle import load, save
from blender_rl_guiding.settings import BSDF, Machine, QTable, Render, Uniform

from . import mutations, npz, scenes
from .guard import Guard
from .ledger import FoundError

PIXELS = 64 * 64  # largest image that is rendered in its own size
MOST = 64  # bounce limit of what is rendered, so that none takes minutes
METHODS = (
    *(Render(spp=2, nee=nee, guide=guide) for nee in (True, False) for guide in (BSDF(), QTable(cells=4, recorded=500))),
    Render(spp=2, guide=Uniform()),
    Render(spp=2, passes=True, sampler="independent"),
)


class Fuzz:
    """See `trying.Trial`. `every`: render each n-th accepted bundle, 0 for none. `gentle`: damage in ways that are often accepted."""

    def __init__(self, guard: Guard, every: int = 0, gentle: bool = False) -> None:
        self._every, self._gentle, self._accepted = every, gentle, 0
        self._texts = (*mutations.TEXTS, *guard.ways_out)
        path = guard.root / "tmp" / "whole.npz"
        save(scenes.whole(), path)
        with np.load(path) as file:
            self._arrays: dict[str, Any] = {name: file[name] for name in file.files}
        self._header = json.loads(str(self._arrays.pop("header")))
        self._compile(path)
        self._values = [place for place in mutations.places(self._header) if isinstance(mutations.at(self._header, place), int | float)]

    def attempt(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        path = folder / "scene.npz"
        path.write_bytes(self._damaged(rng))
        scene = load(path)
        self._accepted += 1
        from blender_rl_guiding.render import render
        from blender_rl_guiding.render.stage import build_stage

        if not self._every or self._accepted % self._every:
            build_stage(scene)
            return "accepted", ""
        camera, bounces = scene.camera, scene.bounces
        if camera.width * camera.height > PIXELS:
            camera = replace(camera, width=scenes.SIZE, height=scenes.SIZE)
        limits = {name: min(getattr(bounces, name), MOST) for name in ("total", "diffuse", "glossy", "transmission", "transparent")}
        result = render(replace(scene, camera=camera, bounces=replace(bounces, **limits)), rng.choice(METHODS), Machine(threads=2))
        if not np.isfinite(result.image).all():
            raise FoundError("image: it has pixels that are not finite")
        return "rendered", ""

    def _compile(self, path: Path) -> None:
        """Compile all kernels that inputs need; otherwise a slow first input would count as hanging."""
        from blender_rl_guiding.render import render
        from blender_rl_guiding.render.stage import build_stage

        build_stage(load(path))
        for method in METHODS if self._every else ():
            render(load(path), method, Machine(threads=2))

    def _damaged(self, rng: random.Random) -> bytes:
        """A bundle with one or two faults. If `gentle`, other numbers in the header or other elements of arrays: these often pass."""
        arrays, header = dict(self._arrays), self._header
        kinds = ("number", "number", "element") if self._gentle else ("header", "header", "arrays", "arrays", "zip", "number")
        kind = rng.choice(kinds)
        if kind == "number":
            header = json.loads(json.dumps(header))
            for _ in range(rng.choice((1, 2, 5))):
                *place, last = rng.choice(self._values)
                holder = mutations.at(header, place)
                holder[last] = mutations.near(holder[last], rng) if rng.random() < 0.6 else rng.choice(mutations.NUMBERS)
        elif kind == "header":
            header = mutations.damaged(header, rng, self._texts)
        elif kind == "element":
            self._element(arrays, rng)
        elif kind == "arrays":
            for name in rng.sample(list(arrays), rng.choice((1, 1, 2))):
                if rng.random() < 0.1:
                    arrays[name] = arrays[rng.choice(list(arrays))]
                elif rng.random() < 0.1:
                    del arrays[name]
                else:
                    arrays[name] = npz.damaged_array(arrays[name], rng)
        said = mutations.text(header, rng) if kind == "header" else json.dumps(header)
        arrays["header"] = np.array(said.encode("utf-8", "replace").decode("utf-8", "replace") if rng.random() < 0.99 else [said])
        return npz.archive(arrays, rng if kind == "zip" else None)

    def _element(self, arrays: dict[str, Any], rng: random.Random) -> None:
        """Replace one element of an array by another of the same array, or turn one of its bits."""
        name = rng.choice([name for name, array in arrays.items() if array.size])
        flat = np.array(arrays[name])
        k = rng.randrange(flat.size)
        if rng.random() < 0.5:
            flat.reshape(-1)[k] = flat.reshape(-1)[rng.randrange(flat.size)]
        else:
            flat.reshape(-1).view(np.uint8)[k * flat.itemsize + rng.randrange(flat.itemsize)] ^= 1 << rng.randrange(8)
        arrays[name] = flat
