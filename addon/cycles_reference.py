"""Renders a reference with Cycles, with all settings off that change the mean. Runs in a separate Blender.

blender -b --factory-startup --python cycles_reference.py -- SCENE.blend SCENE SAMPLES OUT.exr

The script ends when its stdin does.
"""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))  # the add-on is not installed in that Blender

from lifeline import hold
from neutral import CYCLES, apply, first_layer, neutral


def prepare(scene: bpy.types.Scene, spp: int) -> None:
    """Set up a scene such that Cycles converges to the unbiased image of this frame and size, cropped to the render region."""
    scene.animation_data_clear()  # otherwise animation would overwrite `samples` and others; the scene is already at its frame
    neutral(scene)
    apply(CYCLES, scene.cycles)
    scene.cycles.samples = spp
    scene.render.engine = "CYCLES"
    scene.render.use_motion_blur, scene.render.use_crop_to_border = False, True
    scene.render.use_file_extension = False


def main(arguments: list[str]) -> int:
    """Render; returns the exit status. On failure the reason is on stderr."""
    blend, name, spp, out = arguments
    hold()
    try:
        bpy.ops.wm.open_mainfile(filepath=blend, load_ui=False, use_scripts=False)
        scene = bpy.data.scenes[name]
        prepare(scene, int(spp))
        scene.render.filepath = out
        bpy.ops.render.render(scene=name, layer=first_layer(scene), write_still=True)
    except RuntimeError as error:
        print(" ".join(str(error).split()), file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[sys.argv.index("--") + 1 :]))
