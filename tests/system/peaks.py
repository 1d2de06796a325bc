"""Estimated memory / measured peak memory: `python -m tests.system.peaks`, on Linux. Prints one line of JSON: {name: ratio}."""

import ctypes
import json
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from blender_rl_guiding.experiments.runs import Task, save_run
from blender_rl_guiding.render import render, warm_up
from blender_rl_guiding.render.needs import needs
from blender_rl_guiding.scene.data import SceneData, Texture
from blender_rl_guiding.scene.description import CAMERA, VISIBLE
from blender_rl_guiding.settings import BSDF, Machine, QTable, Render
from tests import scenes

ROOM, MACHINE = scenes.tiny(48), Machine(threads=2)


def status(name: str) -> int:
    """Bytes of this process. VmRSS: resident memory now. VmHWM: the maximum of that since the last reset."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(name))


def ratio(scene: SceneData, settings: Render) -> float:
    """(estimated bytes) / (measured bytes) of a render, with saving."""
    ctypes.CDLL(None).malloc_trim(0)  # otherwise the process keeps freed memory
    foreseen, before = needs(scene, settings, MACHINE).total, status("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")
    result = render(scene, settings, MACHINE)
    with TemporaryDirectory() as folder:
        save_run(Task(Path(folder), scene, settings), MACHINE, result)
    return foreseen / (status("VmHWM") - before)


def scattered(count: int) -> SceneData:
    """Small triangles. The camera does not see every second one."""
    places = np.random.default_rng(0).random((count, 1, 3))
    corners = np.float32(places + np.array(((0, 0, 0), (0.01, 0, 0), (0, 0.01, 0))))
    return replace(
        ROOM,
        vertices=corners.reshape(-1, 3),
        triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        normals=np.broadcast_to(np.float32((0, 0, 1)), (count, 3, 3)).copy(),
        material=np.zeros(count, np.int32),
        object=np.arange(count, dtype=np.int32),
        visibility=np.where(np.arange(count) % 2, VISIBLE, VISIBLE - CAMERA).astype(np.uint8),
    )


def meshes(count: int) -> SceneData:
    """Instances: each mesh is a triangle and is placed once."""
    scene = scattered(count)
    return replace(
        scene,
        object=scene.object[:0],
        visibility=np.full(count, VISIBLE, np.uint8),
        meshes=scene.object,
        instances=scene.object,
        instance_to_world=np.broadcast_to(np.eye(3, 4, dtype=np.float32), (count, 3, 4)).copy(),
    )


def main() -> None:
    """Measure all ratios, and print them."""
    wide = replace(ROOM, camera=replace(ROOM.camera, width=1600, height=1200))
    papered = replace(ROOM, textures=(Texture("", False, np.ones((4096, 4096, 4), np.float32)),))
    warm_up(BSDF(), MACHINE)
    warm_up(QTable(), MACHINE)
    found = {
        "runs of visibility": ratio(scattered(90_000), Render(spp=1)),
        "meshes": ratio(meshes(30_000), Render(spp=1)),
        "passes": ratio(wide, Render(spp=1, max_bounces=1, passes=True)),
        "textures": ratio(papered, Render(spp=1)),
        "table": ratio(ROOM, Render(spp=33, guide=QTable(cells=64))),
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
