"""What a render will take of memory, part by part, told before any of it is taken.

Bytes beyond those of the arrays themselves were measured, by processes whose peak is one part's: tests/system/test_memory.py.
"""

import os
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..guiding.cell_count import cells_found
from ..memory import available, in_words
from ..scene.data import SceneData
from ..scene.description import emits
from ..settings import DQN, Machine, QTable, Render
from ..sizes import sizes
from .path_tracer import MOST_LEARNT
from .stage import wants_passes

TRANSITION = 68  # bytes of one
PROGRAM = 250e6  # bytes of a process that renders, before it has a scene


class Part(NamedTuple):
    """One of those that memory goes to."""

    name: str
    bytes: float
    lower: str  # what makes it less


def parts(scene: SceneData, settings: Render, machine: Machine) -> list[Part]:
    """All parts, beside what the scene takes already."""
    return [
        _image(scene, settings),
        _geometry(scene),
        Part("textures", float(sum(texture.texels.nbytes for texture in scene.textures)), "the size of the scene's textures"),
        _attributes(scene),
        *_learning(scene, settings, machine),
    ]


def require(scene: SceneData, settings: Render, machine: Machine) -> None:
    """InputError where a render cannot fit into the memory that is free."""
    if fault := lacking(parts(scene, settings, machine), available()):
        raise InputError(fault)


def lacking(found: list[Part], free: float) -> str:
    """What does not fit, with the part that is largest, in one line; empty if all of it does."""
    total, largest = sum(part.bytes for part in found), max(found, key=lambda part: part.bytes)
    if total <= free:
        return ""
    return f"{said(total, found)}, but {in_words(free)} are free: lower {largest.lower}"


def said(total: float, found: list[Part]) -> str:
    """How much is needed, and for what most of it."""
    largest = max(found, key=lambda part: part.bytes)
    return f"rendering takes about {in_words(total)} of memory, {in_words(largest.bytes)} of it for the {largest.name}"


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
    """Embree's tree while it is built, vertices from the scene's origin, and the faces of what emits."""
    shining = np.array([any(map(emits, shader.closures)) for shader in scene.shaders], bool)
    emitting = int(shining[scene.material].sum()) if shining.any() else 0
    size = 20e6 + 110 * len(scene.triangles) + scene.vertices.nbytes + 155 * len(scene.instances) + 300 * emitting
    return Part("geometry", size, "the number of triangles and instances")


def _attributes(scene: SceneData) -> Part:
    rows = 24 * scene.attribute_rows.size
    bumps = any(step.op == "bump" for shader in (*scene.shaders, scene.world) for step in shader.code)
    copied = scene.attributes.nbytes + 72 * len(scene.triangles) + 24 * len(scene.visibility) if bumps else 0
    return Part("attributes of the mesh", float(rows + copied), "the number of triangles, UV maps and colour attributes")


def _learning(scene: SceneData, settings: Render, machine: Machine) -> list[Part]:
    guide = settings.guide
    if not isinstance(guide, QTable | DQN):
        return []
    bounces = (settings.max_bounces if settings.max_bounces >= 0 else scene.bounces.total) + 1
    # Of a path as many vertices are counted as half of its limit.
    each_pass = min(guide.recorded, scene.camera.width * scene.camera.height * min(bounces, MOST_LEARNT) / 2)
    visits = each_pass * max(settings.spp - 1, 1)
    threads = machine.threads or os.cpu_count() or 1
    room = threads * machine.batch * min(bounces, MOST_LEARNT) * TRANSITION
    recorded = Part("transitions of a pass", 2.2 * TRANSITION * each_pass + min(room, TRANSITION * each_pass), "the guide's recorded")
    cells, patches = cells_found(scene, guide.cells, visits), guide.rows * guide.columns
    if isinstance(guide, QTable):
        return [recorded, Part("table", cells * (400 + 50 * patches), "the guide's cells, rows or columns")]
    return [recorded, *_network(guide, cells, patches, visits)]


def _network(guide: DQN, cells: float, patches: int, visits: float) -> list[Part]:
    network = sizes(guide)
    inside = sum(network.widths[:-1]) + sum(network.encoder)
    shown = min(guide.batch, guide.memory, visits) * 4 * (2 * inside + 2 * guide.width + 3 * patches)
    table = cells * (300 + 24 * patches + 8 * inside)
    return [
        Part("replay memory", TRANSITION * min(guide.memory, visits), "the guide's memory"),
        Part("network", 28.0 * network.parameters, "the guide's width or layers"),
        Part("activations of a batch", float(shown), "the guide's batch, width or layers"),
        Part("table", table, "the guide's cells, rows or columns"),
    ]
