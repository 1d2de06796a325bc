"""One measurement in a child process, which has its own memory peak: `python -m benchmarks.size_child WHAT ...`.

It prints one line of JSON. Each NAME in seconds of wall time has a NAME_cpu: processor time of all threads, which varies less on a
shared machine.
"""

import json
import os
import resource
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from blender_rl_guiding.experiments.runs import Task, save_run
from blender_rl_guiding.guiding import make_guide
from blender_rl_guiding.lights.emitters import Lights, lights
from blender_rl_guiding.lights.inverse import inverse_table
from blender_rl_guiding.render import render, warm_up
from blender_rl_guiding.render.film import Film
from blender_rl_guiding.render.passes import PassTracer
from blender_rl_guiding.scene.bundle import load, save
from blender_rl_guiding.scene.data import ARRAYS, SceneData
from blender_rl_guiding.settings import BSDF, Machine, Render

from .cornell import cornell_box
from .size_scenes import lit_floor, write_forest, write_room

Measured = dict[str, Any]


@contextmanager
def timed(into: Measured, name: str) -> Iterator[None]:
    """Adds `name` and `name`_cpu: wall and processor seconds of the block."""
    wall, cpu = time.perf_counter(), time.process_time()
    yield
    into[name], into[f"{name}_cpu"] = time.perf_counter() - wall, time.process_time() - cpu


def peak() -> int:
    """This process's memory peak in bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def warm() -> Measured:
    """Compiles all kernels for the other measurements: compiling takes more memory than rendering."""
    warm_up(BSDF(), Machine())
    return {}


# ------------------------------------------------------------------------------------------------------------ triangles


def room(blend: str, cuts: str, pixels: str) -> Measured:
    """Makes the .blend. Nothing is measured."""
    write_room(Path(blend), int(cuts), int(pixels))
    return {}


def forest(blend: str, trees: str, pixels: str) -> Measured:
    """Makes the .blend."""
    write_forest(Path(blend), int(trees), int(pixels))
    return {}


def export(blend: str, bundle: str) -> Measured:
    """The export from Blender, in order: reading the meshes, reading the rest, writing the bundle."""
    bpy = import_module("bpy")
    from addon.export.geometry import read_mesh
    from addon.export.scene import export as export_scene
    from addon.exporter import Exporter

    found: Measured = {}

    class Timed(Exporter):
        """Exports and takes the times. Its image stays black."""

        bl_idname = "RL_GUIDED_SIZE"
        bl_label = "RL Guided Size"

        def render(self, depsgraph: Any) -> None:
            found["opened"] = peak()
            meshes = {thing.data.as_pointer(): thing for thing in depsgraph.objects if thing.type == "MESH"}
            with timed(found, "reading"):
                found["read"] = sum(len(read_mesh(thing.data).corners) for thing in meshes.values())
            with timed(found, "exporting"):
                scene = export_scene(depsgraph, self.frame_set)
            with timed(found, "saving"):
                save(scene, Path(bundle))
            found["triangles"] = len(scene.triangles)

    bpy.utils.register_class(Timed)
    bpy.ops.wm.open_mainfile(filepath=blend, load_ui=False, use_scripts=False)
    bpy.context.scene.render.engine = Timed.bl_idname
    bpy.ops.render.render()
    return found | {"peak": peak()}


def triangles(bundle: str, samples: str) -> Measured:
    """Loading a bundle, building the stage, and tracing."""
    found: Measured = {}
    warm_up(BSDF(), Machine())
    found["warm"] = peak()
    with timed(found, "loading"):
        scene = load(Path(bundle))
    with timed(found, "building"):
        tracer = PassTracer(scene, Render(nee=True), Machine(), learning=False)
    film = Film(scene.camera.width, scene.camera.height)
    everywhere = np.arange(scene.camera.width * scene.camera.height)
    guide = make_guide(BSDF(), scene, 0)
    with timed(found, "tracing"):
        tracer.trace(guide.directions(), film, everywhere, 0, int(samples), 0)
    size = sum(getattr(scene, name).nbytes for name in ARRAYS)
    return found | {"rays": tracer.rays, "bundle": size, "peak": peak()}


# ------------------------------------------------------------------------------------------------------------- emitters


def emitters(count: str, kind: str, pick: str, pixels: str, samples: str) -> Measured:
    """Noise below many lights: rms over pixels of sigma / mean, with sigma the standard deviation of one sample."""
    warm_up(BSDF(), Machine())
    scene = lit_floor(int(count), int(pixels), kind)
    found: Measured = {}
    spp = int(samples)
    with patch("blender_rl_guiding.render.stage.lights", evenly if pick == "evenly" else lights), timed(found, "rendering"):
        result = render(scene, Render(spp=spp, nee=True))
    variance = result.film.variance_of_mean() * spp
    relative = variance.sum(axis=2) / np.maximum(result.image.sum(axis=2), 1e-9) ** 2
    rate = scene.camera.width * scene.camera.height * spp / result.seconds
    return found | {"noise": float(np.sqrt(relative.mean())), "rate": rate, "mean": float(result.image.mean()), "peak": peak()}


def evenly(scene: SceneData, shading: Any, surface: Any) -> Lights:
    """The scene's lights, all with the same probability. Each quad has its own shader."""
    found = lights(scene, shading, surface)
    chance = np.where(found.probability > 0, 1.0, 0.0)
    chance /= chance.sum()
    pdf_area = found.pdf_area * 0
    for k, triangle in enumerate(found.triangle):
        _, e, f, _ = found.faces[k].astype(float)
        pdf_area[scene.material[triangle]] = chance[k] / (0.5 * np.linalg.norm(np.cross(e, f)))
    return found._replace(pick=inverse_table(chance), probability=chance.astype(np.float32), pdf_area=pdf_area)


# --------------------------------------------------------------------------------------------------------------- pixels


def pixels(width: str, height: str, denoise: str, folder: str) -> Measured:
    """All of `rlg render --passes`, files included, on a scene of few triangles."""
    warm_up(BSDF(), Machine())
    found: Measured = {"warm": peak()}
    box = cornell_box()
    scene = replace(box, camera=replace(box.camera, width=int(width), height=int(height)))
    settings = Render(spp=2, nee=True, passes=True, denoise=denoise == "denoised", max_bounces=1)
    with timed(found, "rendering"):
        result = render(scene, settings)
    found["rendered"] = peak()
    with timed(found, "writing"):
        save_run(Task(Path(folder), scene, settings), Machine(), result)
    return found | {"peak": peak()}


WHAT: dict[str, Callable[..., Measured]] = {f.__name__: f for f in (warm, room, forest, export, triangles, emitters, pixels)}


def main() -> None:
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # Blender prints on standard output
    print(json.dumps(WHAT[sys.argv[1]](*sys.argv[2:])), file=answers)


if __name__ == "__main__":
    main()
