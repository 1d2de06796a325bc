"""Peaks of memory beside what was foreseen of them: `python -m tests.system.peaks`, on Linux. One line of JSON, ratios by name."""

import json
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from blender_rl_guiding.experiments.runs import save_run
from blender_rl_guiding.render import render, warm_up
from blender_rl_guiding.render.needs import parts
from blender_rl_guiding.scene.data import SceneData, Texture
from blender_rl_guiding.settings import BSDF, Machine, QTable, Render
from tests import scenes

ROOM, MACHINE = scenes.tiny(48), Machine(threads=2)


def status(name: str) -> int:
    """Bytes of this process: VmRSS now, VmHWM at the most since the last time this was forgotten."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(name))


def ratio(scene: SceneData, settings: Render) -> float:
    """Foreseen over measured bytes of a render that is saved."""
    foreseen, before = sum(part.bytes for part in parts(scene, settings, MACHINE)), status("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")
    result = render(scene, settings, MACHINE)
    with TemporaryDirectory() as folder:
        save_run(Path(folder), scene, "bsdf", settings, MACHINE, result, None)
    return foreseen / (status("VmHWM") - before)


def main() -> None:
    """Measure."""
    wide = replace(ROOM, camera=replace(ROOM.camera, width=1600, height=1200))
    papered = replace(ROOM, textures=(Texture("", False, np.ones((4096, 4096, 4), np.float32)),))
    warm_up(BSDF(), MACHINE)
    warm_up(QTable(), MACHINE)
    found = {
        "passes": ratio(wide, Render(spp=1, max_bounces=1, passes=True)),
        "textures": ratio(papered, Render(spp=1)),
        "table": ratio(ROOM, Render(spp=33, guide=QTable(cells=64))),
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
