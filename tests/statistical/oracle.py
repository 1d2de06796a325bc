"""Renders a .blend by Cycles without bias, once for each seed: python oracle.py SCENE.blend FOLDER SIZE SPP SEEDS.

If SCENE.blend does not exist, this script makes it: a smooth ball and a box with Principled materials under a coloured sky. One material
emits.
Runs in a process of its own, as the bpy module allows one session in each.
"""

import sys
from pathlib import Path

import bpy


def paint(name: str, color: tuple[float, float, float], glow: float = 0.0) -> bpy.types.Material:
    """A Principled material without reflection."""
    material = bpy.data.materials.new(name)
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    values = {"Base Color": (*color, 1), "Specular IOR Level": 0, "Emission Color": (1, 0.5, 0.2, 1), "Emission Strength": glow}
    for socket, value in values.items():
        inputs[socket].default_value = value
    return material


def build(path: Path) -> None:
    """The scene described above."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=20)
    bpy.context.object.data.materials.append(paint("Ground", (0.7, 0.6, 0.5)))
    bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, location=(-1, 0, 1))
    bpy.context.object.data.materials.append(paint("Ball", (0.2, 0.4, 0.9)))
    bpy.context.object.data.shade_smooth()
    bpy.ops.mesh.primitive_cube_add(size=1.5, location=(1.5, 0.5, 0.75), rotation=(0, 0, 0.5))
    bpy.context.object.scale.x = -1
    bpy.context.object.data.materials.append(paint("Box", (0.8, 0.3, 0.2), glow=0.5))
    bpy.ops.object.camera_add(location=(0, -7, 3), rotation=(1.25, 0, 0))
    scene.camera = bpy.context.object
    scene.world = bpy.data.worlds.new("Sky")
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.4, 0.6, 0.9, 1)
    scene.render.resolution_y = scene.render.resolution_x
    scene.cycles.pixel_filter_type = "BOX"  # also set here, so that the export has this filter
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def render(folder: Path, size: int, spp: int, seeds: int) -> None:
    """Write 0.exr, 1.exr, ...: linear, 32 bits, `size` pixels along the longer side."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    width, height = scene.render.resolution_x, scene.render.resolution_y
    scene.render.resolution_x, scene.render.resolution_y = (round(side * size / max(width, height)) for side in (width, height))
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    cycles = scene.cycles
    cycles.samples, cycles.pixel_filter_type = spp, "BOX"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = cycles.light_sampling_threshold = 0.0
    for cycles.seed in range(seeds):
        scene.render.filepath = str(folder / f"{cycles.seed}.exr")
        bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    blend, folder = Path(sys.argv[1]), Path(sys.argv[2])
    if not blend.exists():
        build(blend)
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    render(folder, *map(int, sys.argv[3:]))
