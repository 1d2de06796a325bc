"""Estimates the memory of a render, part by part, before any of it is taken.

Bytes beyond those of the arrays themselves were measured, by processes whose peak is one part's: tests/system/test_memory.py.
"""

import os
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..guiding.cell_count import cells_found
from ..memory import available, in_words
from ..scene.data import SceneData, placed, runs
from ..scene.description import emits
from ..settings import DQN, Machine, QTable, Render
from ..sizes import sizes
from .path_tracer import MOST_LEARNT
from .stage import wants_passes

TRANSITION = 68  # bytes of one
PROGRAM = 250e6  # bytes of a process that renders, before it has a scene
# At least this much of what is told was taken: of what follows from sizes, and of what depends on where paths go, as cells of guides do.
MEASURED, GUESSED = 0.75, 0.4


class Part(NamedTuple):
    """One of those that memory goes to."""

    name: str
    bytes: float
    lower: str  # what makes it less
    sure: float = MEASURED  # share of `bytes` that is taken whatever happens


class Needs(NamedTuple):
    """The memory of a render, beyond that of the scene's arrays."""

    total: float  # bytes, about
    least: float  # bytes
    largest: Part

    def said(self, total: float) -> str:
        """How much is needed, for what most of it; `total`: bytes, of all renders that go on at a time."""
        return f"rendering takes about {in_words(total)} of memory, {in_words(self.largest.bytes)} of it for the {self.largest.name}"

    def lacking(self, free: float) -> str:
        """One line if the render surely does not fit; empty if it may."""
        return f"{self.said(self.total)}, but {in_words(free)} are free: lower {self.largest.lower}" if self.least > free else ""


def needs(scene: SceneData, settings: Render, machine: Machine, rough: bool = False) -> Needs:
    """The sum of all parts; a rough one is too high, but looks at no surface."""
    parts = [
        _image(scene, settings),
        _geometry(scene),
        Part("textures", float(sum(texture.texels.nbytes for texture in scene.textures)), "the size of the scene's textures"),
        _attributes(scene),
        *_learning(scene, settings, machine, rough),
    ]
    least = sum(part.bytes * part.sure for part in parts)
    return Needs(sum(part.bytes for part in parts), least, max(parts, key=lambda part: part.bytes))


def require(scene: SceneData, settings: Render, machine: Machine) -> None:
    """InputError where a render surely does not fit into the memory that can be had."""
    free = available()
    if needs(scene, settings, machine, rough=True).lacking(free) and (fault := needs(scene, settings, machine).lacking(free)):
        raise InputError(fault)


def _image(scene: SceneData, settings: Render) -> Part:
    """The film, and the copies that are made of it where it is written."""
    pixels, passes = scene.camera.width * scene.camera.height, wants_passes(scene, settings)
    film, writing = (140, 210) if passes else (72, 60)
    if settings.noise:
        writing = max(writing, 95)
    denoising = min(450e6 + 450 * pixels, 1.1e9) + 60 * pixels if settings.denoise else 0.0  # of Open Image Denoise, see `denoise.MEMORY`
    lower = "the resolution, or leave out passes" if passes else "the resolution"
    return Part("image", film * pixels + max(writing * pixels, denoising), lower)


def _geometry(scene: SceneData) -> Part:
    """Embree's trees while they are built, vertices from the scene's origin, and the faces of what emits."""
    shining = np.array([any(map(emits, shader.closures)) for shader in scene.shaders], bool)
    emitting = int(shining[scene.material].sum()) if shining.any() else 0
    size = 20e6 + 110 * len(scene.triangles) + scene.vertices.nbytes + 155 * len(scene.instances) + 300 * emitting
    size += 4000 * len(scene.meshes) + 600 * _geometries(scene)
    return Part("geometry", size, "the number of triangles, meshes and instances, or of objects that are hidden from some rays")


def _geometries(scene: SceneData) -> int:
    """How many Embree gets: one for each run of triangles, and of instances of a mesh, that the same kinds of rays see."""
    of_instances = scene.instances.astype(np.int64) << 32 | scene.visibility[placed(scene) :]
    return sum(1 for seen in (scene.visibility[scene.object], of_instances) for _ in runs(seen))


def _attributes(scene: SceneData) -> Part:
    rows = 24 * scene.attribute_rows.size
    bumps = any(step.op == "bump" for shader in (*scene.shaders, scene.world) for step in shader.code)
    copied = scene.attributes.nbytes + 72 * len(scene.triangles) + 24 * len(scene.visibility) if bumps else 0
    return Part("attributes of the mesh", float(rows + copied), "the number of triangles, UV maps and colour attributes")


def _learning(scene: SceneData, settings: Render, machine: Machine, rough: bool) -> list[Part]:
    guide = settings.guide
    if not isinstance(guide, QTable | DQN):
        return []
    bounces = (settings.max_bounces if settings.max_bounces >= 0 else scene.bounces.total) + 1
    # Of a path as many vertices are counted as half of its limit.
    each_pass = min(guide.recorded, scene.camera.width * scene.camera.height * min(bounces, MOST_LEARNT) / 2)
    visits = each_pass * max(settings.spp - 1, 1)
    threads = machine.threads or os.cpu_count() or 1
    room = threads * machine.batch * min(bounces, MOST_LEARNT) * TRANSITION
    size = 2.2 * TRANSITION * each_pass + min(room, TRANSITION * each_pass)
    recorded = Part("transitions of a pass", size, "the guide's recorded", GUESSED)
    cells, patches = visits if rough else cells_found(scene, guide.cells, visits), guide.rows * guide.columns
    if isinstance(guide, QTable):
        return [recorded, Part("table", cells * (400 + 50 * patches), "the guide's cells, rows or columns", GUESSED)]
    return [recorded, *_network(guide, cells, patches, visits)]


def _network(guide: DQN, cells: float, patches: int, visits: float) -> list[Part]:
    network = sizes(guide)
    inside = sum(network.widths[:-1]) + sum(network.encoder)
    shown = min(guide.batch, guide.memory, visits) * 4 * (2 * inside + 2 * guide.width + 3 * patches)
    table = cells * (300 + 24 * patches + 8 * inside)
    return [
        Part("replay memory", TRANSITION * min(guide.memory, visits), "the guide's memory", GUESSED),
        Part("network", 28.0 * network.parameters, "the guide's width or layers"),
        Part("activations of a batch", float(shown), "the guide's batch, width or layers"),
        Part("table", table, "the guide's cells, rows or columns", GUESSED),
    ]
