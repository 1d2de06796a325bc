"""Measures Blender's reflection models in Cycles, without noise: python bsdf_oracle.py SPEC.json OUT.npy.

Each case is a pixel that shows a quad with the case's material. An orthographic camera sees the quad from wo, and one sun at a time
lights it. The pixel's radiance is f |cos|. SPEC has
  materials  for each material {"node", "inputs": numbers, colours or vectors by name, "properties"},
  cases      for each case (index of a material; 3 x 3 matrix from the quad's frame, with normal +z, to world space, with wo = +z;
             whether the camera sees the quad from behind),
  suns       unit vectors in world space towards the light.
OUT is (suns, cases, 3).
Runs in a process of its own, as the bpy module allows one session in each.
"""

import json
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
import OpenEXR

SPACING = 4  # pixels between cases, so that no quad covers the pixel of another case


def material(spec: dict) -> bpy.types.Material:
    """A material of one node."""
    made = bpy.data.materials.new("M")
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    node, output = nodes.new(spec["node"]), nodes.new("ShaderNodeOutputMaterial")
    for name, value in spec.get("properties", {}).items():
        setattr(node, name, value)
    for name, value in spec["inputs"].items():
        socket = node.inputs[name]
        if socket.type == "VECTOR":  # a normal or tangent has an effect only if linked
            vector = nodes.new("ShaderNodeCombineXYZ")
            for axis, x in zip("XYZ", value, strict=True):
                vector.inputs[axis].default_value = x
            links.new(vector.outputs[0], socket)
        else:
            socket.default_value = (*value, 1) if isinstance(value, list) else value
    links.new(node.outputs[0], output.inputs["Surface"])
    return made


def place(cases: list, materials: list) -> int:
    """Make one mesh of all quads, on a square grid of pixels. Returns the number of pixels along the grid's side."""
    side = int(np.ceil(np.sqrt(len(cases))))
    vertices, faces = [], []
    for k, (_, frame, back) in enumerate(cases):
        center = SPACING * np.array([k % side, k // side, 0]) + [0.5, 0.5, 0]
        to_world = np.array(frame)
        # Long enough along the tilt to cover the pixel even at a grazing view.
        x = np.cross(to_world[:, 2], [0, 0, 1])
        x = x / np.linalg.norm(x) if np.linalg.norm(x) > 1e-9 else np.array([1.0, 0, 0])
        y = np.cross(to_world[:, 2], x) / abs(to_world[2, 2])
        corners = [center + a * x + b * y for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        faces.append([4 * k + i for i in ((3, 2, 1, 0) if back else (0, 1, 2, 3))])
        vertices += corners
    mesh = bpy.data.meshes.new("Quads")
    mesh.from_pydata(vertices, [], faces)
    for m in materials:
        mesh.materials.append(m)
    mesh.polygons.foreach_set("material_index", [case[0] for case in cases])
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Quads", mesh))
    return side


def prepare(side: int) -> None:
    """Camera, sun and settings: one exact sample per pixel."""
    scene = bpy.context.scene
    bpy.ops.object.light_add(type="SUN")
    sun = bpy.context.object.data
    sun.angle, sun.energy, sun.use_shadow = 0, 1, False
    bpy.ops.object.camera_add(location=(SPACING * side / 2, SPACING * side / 2, 1000))
    scene.camera = bpy.context.object
    scene.camera.data.type, scene.camera.data.ortho_scale, scene.camera.data.clip_end = "ORTHO", SPACING * side, 1e5
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = SPACING * side
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    cycles = scene.cycles
    cycles.samples, cycles.pixel_filter_type, cycles.max_bounces = 1, "BOX", 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = cycles.light_sampling_threshold = 0.0


def render(direction: list, side: int, count: int, folder: Path) -> np.ndarray:
    """The radiance (cases, 3) under a sun in one direction."""
    from mathutils import Vector

    sun = next(o for o in bpy.context.scene.objects if o.type == "LIGHT")
    sun.rotation_mode = "QUATERNION"
    sun.rotation_quaternion = Vector(direction).to_track_quat("Z", "Y")
    bpy.context.scene.render.filepath = str(folder / "out.exr")
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(str(folder / "out.exr")) as file:
        channels = file.channels()
        name = "RGB" if "RGB" in channels else "RGBA"
        pixels = channels[name].pixels[::-1][::SPACING, ::SPACING, :3]
    return pixels.reshape(-1, 3)[:count]


def main(spec: dict, out: Path) -> None:
    """Measure all cases under all suns."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.world = None
    side = place(spec["cases"], [material(m) for m in spec["materials"]])
    prepare(side)
    with tempfile.TemporaryDirectory() as folder:
        np.save(out, np.stack([render(s, side, len(spec["cases"]), Path(folder)) for s in spec["suns"]]))


if __name__ == "__main__":
    main(json.loads(Path(sys.argv[1]).read_text()), Path(sys.argv[2]))
