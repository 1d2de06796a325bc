"""Renders a scene by Cycles without any of its shortcuts that change the mean: a reference. Runs in a Blender of its own.

blender -b --factory-startup --python cycles_reference.py -- SCENE.blend SCENE SAMPLES OUT.exr
"""

import sys
from typing import Any

import bpy

SEED = 1_000_003  # far from the seeds that people choose
# What is off or at its neutral value in a reference; names that a Blender version does not have are skipped.
UNBIASED: dict[str, Any] = {
    "use_adaptive_sampling": False,
    "use_denoising": False,
    "sample_clamp_direct": 0.0,
    "sample_clamp_indirect": 0.0,
    "blur_glossy": 0.0,
    "light_sampling_threshold": 0.0,
    "use_fast_gi": False,
    "use_guiding": False,
    "use_animated_seed": False,
    "time_limit": 0.0,
    "sample_offset": 0,
    "use_sample_subset": False,
    "seed": SEED,
}


def prepare(scene: bpy.types.Scene, spp: int) -> None:
    """Set a scene to be rendered by Cycles as it would converge to."""
    scene.render.engine = "CYCLES"
    for name, value in UNBIASED.items():
        if name in scene.cycles.bl_rna.properties:
            setattr(scene.cycles, name, value)
    scene.cycles.samples = spp
    scene.render.use_compositing = scene.render.use_sequencer = scene.render.use_motion_blur = False
    for layer in scene.view_layers:
        layer.samples = 0  # no number of its own
    if bpy.app.version >= (5, 0):
        scene.render.image_settings.media_type = "IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.image_settings.color_depth = "32"
    scene.render.use_file_extension = False


def main(arguments: list[str]) -> int:
    """Render; gives the exit status, with the reason on stderr."""
    blend, name, spp, out = arguments
    try:
        bpy.ops.wm.open_mainfile(filepath=blend, load_ui=False, use_scripts=False)
        scene = bpy.data.scenes[name]
        prepare(scene, int(spp))
        scene.render.filepath = out
        first = next(layer.name for layer in scene.view_layers if layer.use)
        bpy.ops.render.render(scene=name, layer=first, write_still=True)
    except RuntimeError as error:
        print(" ".join(str(error).split()), file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]))
