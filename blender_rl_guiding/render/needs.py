"""Estimates the memory of a render, part by part, before the render allocates it.

The bytes of arrays are computed. Other bytes were measured in processes whose peak is that of one part: tests/system/test_memory.py.
"""

import os
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..guiding import guide_class
from ..guiding.base import TRANSITION
from ..memory import GUESSED, Part, available, in_words
from ..scene.data import SceneData, placed, runs
from ..scene.description import emits
from ..settings import Machine, Render
from .path_tracer import MOST_LEARNT
from .stage import wants_passes

PROGRAM = 250e6  # bytes of a render process before it loads a scene


class Needs(NamedTuple):
    """The memory of a render, beyond that of the scene's arrays."""

    total: float  # bytes, the estimate
    least: float  # bytes, a lower bound
    largest: Part

    def said(self, total: float) -> str:
        """The needed memory and its largest part, in words. total: bytes of all renders that run at the same time."""
        return f"rendering takes about {in_words(total)} of memory, {in_words(self.largest.bytes)} of it for the {self.largest.name}"

    def lacking(self, free: float) -> str:
        """One line if the render surely does not fit; empty if it may."""
        return f"{self.said(self.total)}, but {in_words(free)} are free: lower {self.largest.lower}" if self.least > free else ""


def needs(scene: SceneData, settings: Render, machine: Machine, rough: bool = False) -> Needs:
    """The sum of all parts. rough: an upper bound, which reads no surface."""
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
    """InputError if a render surely does not fit into the memory that is available."""
    free = available()
    if needs(scene, settings, machine, rough=True).lacking(free) and (fault := needs(scene, settings, machine).lacking(free)):
        raise InputError(fault)


def _image(scene: SceneData, settings: Render) -> Part:
    """The film, and its copies when the image is written."""
    pixels, passes = scene.camera.width * scene.camera.height, wants_passes(scene, settings)
    film, writing = (140, 210) if passes else (72, 60)
    if settings.noise:
        writing = max(writing, 95)
    denoising = min(450e6 + 450 * pixels, 1.1e9) + 60 * pixels if settings.denoise else 0.0  # of Open Image Denoise, see `denoise.MEMORY`
    lower = "the resolution, or leave out passes" if passes else "the resolution"
    return Part("image", film * pixels + max(writing * pixels, denoising), lower)


def _geometry(scene: SceneData) -> Part:
    """Embree's trees while they are built, vertices from the scene's origin, and the faces that emit."""
    shining = np.array([any(map(emits, shader.closures)) for shader in scene.shaders], bool)
    emitting = int(shining[scene.material].sum()) if shining.any() else 0
    size = 20e6 + 110 * len(scene.triangles) + scene.vertices.nbytes + 155 * len(scene.instances) + 300 * emitting
    size += 4000 * len(scene.meshes) + 600 * _geometries(scene)
    return Part("geometry", size, "the number of triangles, meshes and instances, or of objects that are hidden from some rays")


def _geometries(scene: SceneData) -> int:
    """The number of geometries in Embree: one per run of triangles of equal visibility, or of instances of equal mesh and visibility."""
    of_instances = scene.instances.astype(np.int64) << 32 | scene.visibility[placed(scene) :]
    return sum(1 for seen in (scene.visibility[scene.object], of_instances) for _ in runs(seen))


def _attributes(scene: SceneData) -> Part:
    rows = 24 * scene.attribute_rows.size
    bumps = any(step.op == "bump" for shader in (*scene.shaders, scene.world) for step in shader.code)
    copied = scene.attributes.nbytes + 72 * len(scene.triangles) + 24 * len(scene.visibility) if bumps else 0
    return Part("attributes of the mesh", float(rows + copied), "the number of triangles, UV maps and colour attributes")


def _learning(scene: SceneData, settings: Render, machine: Machine, rough: bool) -> list[Part]:
    """The transitions of a pass, and the guide's own parts."""
    guide = settings.guide
    if not guide.learns:
        return []
    bounces = (settings.max_bounces if settings.max_bounces >= 0 else scene.bounces.total) + 1
    # Assumes that a path has half as many vertices as its limit allows.
    each_pass = min(guide.recorded, scene.camera.width * scene.camera.height * min(bounces, MOST_LEARNT) / 2)
    threads = machine.threads or os.cpu_count() or 1
    room = threads * machine.batch * min(bounces, MOST_LEARNT) * TRANSITION
    size = 2.2 * TRANSITION * each_pass + min(room, TRANSITION * each_pass)
    recorded = Part("transitions of a pass", size, "the guide's recorded", GUESSED)
    visits = each_pass * max(settings.spp - 1, 1)
    return [recorded, *guide_class(guide).memory(guide, scene, visits, rough)]
