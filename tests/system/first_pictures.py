"""Renders Blender's start-up files, a user's first pictures, by Cycles: python -m tests.system.first_pictures FOLDER.

For each start-up file with something to render, FOLDER gets NAME.blend (the file with a smaller image), NAME-reference.exr, and
NAME-0.exr, NAME-1.exr, ... with `SPP` samples and no bias. Runs in a process of its own, with Blender inside.
"""

import sys
from pathlib import Path

import bpy

from addon.cycles_reference import prepare

SPP, SEEDS, REFERENCE_SPP = 32, 2, 1024
SIZE = 96, 54
# Start-up files by template. Left out: VFX and Video_Editing show only the world, without noise; 2D_Animation and Storyboarding have
# only grease pencil, which the coverage list names.
FILES = {"default": None, "sculpting": "Sculpting"}


def opened(template: str | None) -> bpy.types.Scene:
    """Open a start-up file. The file for sculpting has a camera, but the scene does not use it: make it the scene's camera."""
    if template:
        bpy.ops.wm.read_homefile(use_factory_startup=True, app_template=template)
    else:
        bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.camera = scene.camera or bpy.data.objects["Camera"]
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    return scene


def render(scene: bpy.types.Scene, path: Path, samples: int, seed: int) -> None:
    """Render an image."""
    prepare(scene, samples)
    scene.cycles.seed, scene.render.filepath = seed, str(path)
    bpy.ops.render.render(write_still=True)


def main(folder: Path) -> None:
    """Render all files."""
    for name, template in FILES.items():
        scene = opened(template)
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{name}.blend"))
        for seed in range(SEEDS):
            render(scene, folder / f"{name}-{seed}.exr", SPP, seed)
        render(scene, folder / f"{name}-reference.exr", REFERENCE_SPP, 1_000_000)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
