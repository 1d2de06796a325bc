"""Render settings that change the picture, crash Blender or write files, each with its neutral value.

| door                             | from here                     | what it keeps on purpose                                              |
|----------------------------------|-------------------------------|-----------------------------------------------------------------------|
| headless.py, capture.py: export  | `neutral`                     | frame, camera, size, render region, film, bounces, Simplify, and      |
|                                  |                               | motion blur, whose losses it lists                                    |
| cycles_reference.py              | `neutral`, `CYCLES`, crop     | the same, so that it is of the same pixels; no motion blur            |
| comparison/slots.py: shows images| `PIPELINE`, taken back after  | all else: it is the user's scene                                      |
| cycles_pictures.py               | `neutral`, of its own scene   | a world of the user's file                                            |
| F12                              | nothing: it is as asked for   | everything                                                            |

This file imports nothing of the add-on: scripts use it in a Blender without it. Names that a version of Blender lacks are skipped;
`panorama_of` finds those that have moved.
"""

from typing import Any

import bpy

# scene.render: steps that Blender does before or after the render of any engine.
PIPELINE: dict[str, Any] = {
    "use_freestyle": False,  # lines over the image; crashes Blender 5.2 with an engine that gives no image, or a scene that is a copy
    "use_compositing": False,  # changes the image; its File Outputs write files
    "use_sequencer": False,  # renders strips instead of the scene
    "use_multiview": False,  # other cameras, two images in one file, or files of other names
    "use_stamp": False,  # draws text over the image, also over floats
    "use_auto_generate_texture_cache": False,  # writes files beside the user's textures
    "use_texture_cache": False,  # textures filtered beforehand
}
# scene.render.image_settings: the format of a file. The order counts: each setting limits the values of the next.
_IMAGE: dict[str, Any] = {
    "media_type": "IMAGE",  # a video has a minimal size
    "file_format": "OPEN_EXR",
    "color_mode": "RGB",
    "color_depth": "32",
    "exr_codec": "ZIP",  # some codecs lose precision
    "views_format": "INDIVIDUAL",
    "color_management": "FOLLOW_SCENE",  # linear, without the display's look
}
# Each of scene.view_layers: the part of the scene that it shows.
_LAYER: dict[str, Any] = {
    "material_override": None,
    "world_override": None,
    "use_solid": True,
    "use_sky": True,
    "use_grease_pencil": False,  # drawn over the image by the graphics card
    "samples": 0,  # 0: the view layer uses the scene's samples
}
# scene.cycles: settings that change the mean, or that correlate a pixel's noise with the noise of other pixels or images.
CYCLES: dict[str, Any] = {
    "use_adaptive_sampling": False,
    "use_denoising": False,
    "sample_clamp_direct": 0.0,
    "sample_clamp_indirect": 0.0,
    "blur_glossy": 0.0,
    "caustics_reflective": True,
    "caustics_refractive": True,
    "light_sampling_threshold": 0.0,
    "use_fast_gi": False,
    "use_guiding": False,
    "use_pixel_jitter": False,  # for debugging Cycles: all samples at one place in the pixel
    "auto_scrambling_distance": False,
    "scrambling_distance": 1.0,
    "use_animated_seed": False,
    "time_limit": 0.0,
    "sample_offset": 0,
    "use_sample_subset": False,
    "seed": 1_000_003,  # far from the seeds that users choose
}


def neutral(scene: bpy.types.Scene) -> None:
    """Make a scene render only itself, into a lossless linear EXR, and write no other file. The old values are lost."""
    apply(PIPELINE, scene.render)
    apply(_IMAGE, scene.render.image_settings)
    for layer in scene.view_layers:
        apply(_LAYER, layer)


def apply(settings: dict[str, Any], owner: Any) -> None:
    """Set the values of all properties that this version of Blender has."""
    for name, value in settings.items():
        if name in owner.bl_rna.properties:
            setattr(owner, name, value)


def first_layer(scene: bpy.types.Scene) -> str:
    """The name of the first view layer that renders; empty if none does."""
    return next((layer.name for layer in scene.view_layers if layer.use), "")


def panorama_of(camera: bpy.types.Camera) -> Any:
    """The owner of a camera's panorama settings. Before Blender 5.0 it was the camera's `cycles`."""
    return camera if hasattr(camera, "panorama_type") else camera.cycles
