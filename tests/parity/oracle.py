"""Builds cases, renders them by Cycles and exports them: python -m tests.parity.oracle FOLDER CASE...

For each case FOLDER gets CASE.bundle.npz, and CASE.npz with the number of renders, the mean of the renders and the variance of this mean,
(H, W, 4) float64 each. If the case fails, FOLDER gets CASE.error with the reason. Runs in a process of its own, with Blender inside.
"""

import sys
import tempfile
import traceback
from pathlib import Path

import bpy
import numpy as np
import OpenEXR

import addon
from addon.exporter import Exporter
from blender_rl_guiding.scene.bundle import save
from blender_rl_guiding.scene.data import SceneData
from tests.parity.cases import CASES, Case
from tests.parity.stage import Stage

RENDERS = 8


class Export(Exporter):
    """An engine that keeps the exported scene and leaves the image black."""

    bl_idname = "RL_GUIDED_PARITY"
    bl_label = "RL Guided Parity"
    exported: SceneData | None = None

    def deliver(self, scene: SceneData) -> None:
        type(self).exported = scene


def render(scene: bpy.types.Scene, samples: int, folder: Path) -> np.ndarray:
    """RENDERS images with different seeds, (RENDERS, H, W, 4) float32, top row first."""
    settings = scene.render
    settings.threads_mode, settings.threads = "FIXED", 1
    settings.use_persistent_data = True
    settings.image_settings.file_format, settings.image_settings.color_depth = "OPEN_EXR", "32"
    settings.image_settings.color_mode = "RGBA"
    scene.cycles.samples = samples
    images = []
    for scene.cycles.seed in range(RENDERS):
        settings.filepath = str(folder / f"{scene.cycles.seed}.exr")  # persistent data does not notice a new seed, but notices a new path
        bpy.ops.render.render(write_still=True)
        with OpenEXR.File(settings.filepath) as file:
            images.append(file.channels()["RGBA"].pixels)
    return np.array(images)


def export(scene: bpy.types.Scene, path: Path) -> None:
    """Export the scene through a render, because only an engine gets the depsgraph in render mode."""
    scene.render.engine = Export.bl_idname
    bpy.ops.render.render()
    assert Export.exported
    save(Export.exported, path)


def run(case: Case, folder: Path) -> None:
    """Write the files of a case into the folder."""
    stage = Stage()
    case.build(stage)
    with tempfile.TemporaryDirectory() as images:
        renders = render(stage.scene, case.samples, Path(images)).astype(np.float64)
    assert len(np.unique(renders[:, ..., :3].sum(axis=(1, 2, 3)))) > 1, "all renders are the same"
    variance = renders.var(axis=0, ddof=1) / RENDERS
    np.savez(folder / f"{case.name}.npz", mean=renders.mean(axis=0), variance=variance, renders=RENDERS)
    export(stage.scene, folder / f"{case.name}.bundle.npz")


def main(folder: Path, names: list[str]) -> None:
    """Make the cases in turn. If one fails, the others are still made."""
    addon.register()
    bpy.utils.register_class(Export)
    for name in names:
        try:
            run(CASES[name], folder)
        except Exception:  # noqa: BLE001  # the case's own test reports it
            (folder / f"{name}.error").write_text(traceback.format_exc(limit=-3))
    bpy.utils.unregister_class(Export)
    addon.unregister()


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
