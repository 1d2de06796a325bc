"""Renders worlds of Sky Textures by Cycles, and exports them: python skies.py CASES.json FOLDER, in the Python of any Blender.

CASES.json maps names to [settings of the node, strength of the background]. For each NAME, FOLDER gets NAME.bundle.npz, the exported
scene, and NAME.npz with
  view  the sky at the middles of 64 x 32 pixels of an equirectangular camera, top row first,
  lit   (64, 3) independent estimates of the radiance that a white floor reflects.
"""

import json
import math
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import addon
from addon.exporter import Exporter
from blender_rl_guiding.scene.bundle import save
from blender_rl_guiding.scene.data import SceneData

SAMPLES = 512


class Export(Exporter):
    """An engine that keeps the exported scene and leaves the image black."""

    bl_idname = "RL_GUIDED_SKIES"
    bl_label = "RL Guided Skies"
    exported: SceneData | None = None

    def deliver(self, scene: SceneData) -> None:
        type(self).exported = scene


def stage() -> bpy.types.Scene:
    """A white floor, a camera that looks around, one that looks down, and Cycles' settings without bias."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles, render = scene.cycles, scene.render
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = cycles.light_sampling_threshold = 0.0
    cycles.max_bounces = 0
    render.use_compositing, render.use_persistent_data = False, True
    if bpy.app.version >= (5, 0):
        render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    bpy.ops.mesh.primitive_plane_add(size=2.0, location=(0.0, 0.0, -50.0))
    white = bpy.data.materials.new("White")
    white.use_nodes = True
    white.node_tree.nodes.clear()
    diffuse, output = (white.node_tree.nodes.new(f"ShaderNode{kind}") for kind in ("BsdfDiffuse", "OutputMaterial"))
    diffuse.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    white.node_tree.links.new(diffuse.outputs[0], output.inputs[0])
    bpy.context.object.data.materials.append(white)
    return scene


def add_camera(scene: bpy.types.Scene, kind: str, at: tuple[float, float, float]) -> None:
    scene.camera = bpy.data.objects.new(kind, bpy.data.cameras.new(kind))
    scene.camera.data.type, scene.camera.location = kind, at
    scene.collection.objects.link(scene.camera)


def add_world(scene: bpy.types.Scene, settings: dict[str, Any], strength: float) -> None:
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        scene.world.use_nodes = True
    tree = scene.world.node_tree
    tree.nodes.clear()
    sky, background, output = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexSky", "Background", "OutputWorld"))
    for name, value in settings.items():
        setattr(sky, name, value)
    background.inputs["Strength"].default_value = strength
    tree.links.new(sky.outputs[0], background.inputs["Color"])
    tree.links.new(background.outputs[0], output.inputs["Surface"])


def render(scene: bpy.types.Scene, folder: Path, width: int, height: int) -> np.ndarray:
    """The image, (height, width, 3) float32, top row first."""
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.filepath = str(folder / "image.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    texels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(texels)
    bpy.data.images.remove(image)
    return texels.reshape(height, width, -1)[::-1, :, :3]


def run(name: str, settings: dict[str, Any], strength: float, folder: Path) -> None:
    """Write the files of a case into the folder."""
    scene = stage()
    add_world(scene, settings, strength)
    add_camera(scene, "ORTHO", (0.0, 0.0, -40.0))
    scene.camera.data.ortho_scale = 1.0
    scene.cycles.samples, scene.cycles.pixel_filter_type = SAMPLES, "BOX"
    lit = render(scene, folder, 8, 8).reshape(-1, 3)
    add_camera(scene, "PANO", (0.0, 0.0, 0.0))
    camera = scene.camera.data if hasattr(scene.camera.data, "panorama_type") else scene.camera.data.cycles
    camera.panorama_type, scene.camera.rotation_euler = "EQUIRECTANGULAR", (math.pi / 2, 0.0, -math.pi / 2)
    scene.cycles.samples, scene.cycles.pixel_filter_type, scene.cycles.filter_width = 1, "GAUSSIAN", 0.01
    np.savez(folder / f"{name}.npz", view=render(scene, folder, 64, 32), lit=lit)
    scene.render.engine = Export.bl_idname
    bpy.ops.render.render()
    assert Export.exported
    save(Export.exported, folder / f"{name}.bundle.npz")


def main(cases: dict[str, Any], folder: Path) -> None:
    """Make the cases in turn."""
    addon.register()
    bpy.utils.register_class(Export)
    try:
        for name, (settings, strength) in cases.items():
            run(name, settings, strength, folder)
    finally:
        bpy.utils.unregister_class(Export)  # otherwise Blender 4.5 hangs at exit
        addon.unregister()


if __name__ == "__main__":
    main(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")), Path(sys.argv[2]))
