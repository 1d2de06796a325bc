"""Builds cases, renders them by Cycles and exports them: python oracle.py FOLDER CASE...

FOLDER receives of each case CASE.npz, the mean of all its renders and its variance, (H, W, 4) float64 each, and CASE.bundle.npz;
or CASE.error, which says in a few lines why it does not. Runs in a process of its own, with Blender inside.
"""

import sys
import traceback
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import bpy
import numpy as np
import OpenEXR
from parity.cases import CASES, Case
from parity.stage import Stage

import addon
from addon.engine import Exporter
from blender_rl_guiding.scene.bundle import save
from blender_rl_guiding.scene.data import SceneData

SEEDS, SAMPLES = 8, 48


class Export(Exporter):
    """Keeps the scene; the image stays black."""

    bl_idname = "RL_GUIDED_PARITY"
    bl_label = "RL Guided Parity"
    exported: SceneData | None = None

    def deliver(self, scene: SceneData) -> None:
        type(self).exported = scene


def render(scene: bpy.types.Scene, case: Case, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """The mean of `SEEDS` renders and its variance. Pixels above one another are top to bottom; alpha is the fourth channel."""
    settings, path = scene.render, folder / f"{case.name}.exr"
    settings.threads_mode, settings.threads = "FIXED", 1
    settings.use_persistent_data = True  # nothing changes between the renders but the seed
    settings.image_settings.file_format, settings.image_settings.color_depth = "OPEN_EXR", "32"
    settings.filepath = str(path)
    scene.cycles.samples = SAMPLES * case.effort
    images = []
    for scene.cycles.seed in range(SEEDS):
        bpy.ops.render.render(write_still=True)
        with OpenEXR.File(str(path)) as file:
            images.append(file.channels()["RGBA"].pixels)
    path.unlink()
    return np.mean(images, axis=0, dtype=np.float64), np.var(images, axis=0, ddof=1, dtype=np.float64) / SEEDS


def export(scene: bpy.types.Scene, path: Path) -> None:
    """Through a render, because only an engine is given the depsgraph in render mode."""
    scene.render.engine = Export.bl_idname
    bpy.ops.render.render()
    assert Export.exported
    save(Export.exported, path)


def run(case: Case, folder: Path) -> None:
    """All that the folder shall receive of a case."""
    stage = Stage()
    case.build(stage)
    stage.scene.render.image_settings.color_mode = "RGBA"
    mean, variance = render(stage.scene, case, folder)
    np.savez(folder / f"{case.name}.npz", mean=mean, variance=variance)
    export(stage.scene, folder / f"{case.name}.bundle.npz")


def main(folder: Path, names: list[str]) -> None:
    """One case after another; one that fails does not keep the others from being made."""
    addon.register()
    bpy.utils.register_class(Export)
    for name in names:
        try:
            run(CASES[name], folder)
        except Exception:  # noqa: BLE001  # reported by the case's own test
            (folder / f"{name}.error").write_text(traceback.format_exc(limit=-3))
    bpy.utils.unregister_class(Export)
    addon.unregister()


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
