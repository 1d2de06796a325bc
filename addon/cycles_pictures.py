"""Renders with Cycles the output of a world's node in all directions: a sky, or any other node. Runs in a separate Blender.

blender -b --factory-startup --python cycles_pictures.py -- JOB.json OUT.npz

A job is {"sky": properties of a Sky Texture node}; or {"blend": file, "world": name, "groups": names of the group nodes around the node,
outermost first, "node": its name, "output": identifier of its output, "frame": number}. The script ends when its stdin does.
"""

import json
import math
import sys
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))  # the add-on is not installed in that Blender

from lifeline import hold
from neutral import neutral, panorama_of

WIDTH, HEIGHT = 512, 256  # of a sky's picture, as Cycles' own tables of the scattering models
ACROSS = 1024  # pixels around the horizon, in a picture of any other node
STEPS = 256  # across the sun's disc
WITHOUT_DISC = ("PREETHAM", "HOSEK_WILKIE")
LIMB = 0.6  # relative darkening at the edge of the disc
BESIDE = 1e-5  # radians on both sides of a line, because a picture needs a width
AROUND, POLES = (-math.pi, math.pi), (-math.pi / 2, math.pi / 2)


def panorama() -> bpy.types.Scene:
    """An empty scene: a panoramic camera whose middle is +y, one sample in the middle of each pixel, and a world without nodes."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    neutral(scene)
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", 1, False, False
    cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", 0.01
    camera = bpy.data.cameras.new("Camera")
    camera.type = "PANO"
    panorama_of(camera).panorama_type = "EQUIRECTANGULAR"
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.rotation_euler = (math.pi / 2, 0.0, 0.0)
    scene.collection.objects.link(scene.camera)
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        scene.world.use_nodes = True
    scene.world.node_tree.nodes.clear()
    scene.world.cycles.sampling_method = "NONE"  # otherwise Cycles would first build a map for light sampling
    return scene


def look(scene: bpy.types.Scene, width: int, height: int, longitudes: tuple[float, float], latitudes: tuple[float, float]) -> np.ndarray:
    """Colours between longitudes, to the right of +y, and latitudes: (height, width, 3) float32, the lowest row first."""
    camera = panorama_of(scene.camera.data)
    camera.longitude_min, camera.longitude_max = longitudes
    camera.latitude_min, camera.latitude_max = latitudes
    scene.render.resolution_x, scene.render.resolution_y = width, height
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder, "picture.exr"))
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        texels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(texels)
    return texels.reshape(height, width, -1)[..., :3]


def look_around(scene: bpy.types.Scene, width: int, height: int) -> np.ndarray:
    """Colours of all directions, as an environment texture has them: +x is in the middle."""
    scene.camera.rotation_euler[2] = -math.pi / 2
    return look(scene, width, height, AROUND, POLES)


# --- skies -----------------------------------------------------------------------------------------------------------


def sky(values: dict[str, Any]) -> dict[str, np.ndarray]:
    """The sky without its sun, and the disc of the sun: black where there is none."""
    picture = whole_sky(values)
    has_disc = values["sun_disc"] and values["sky_type"] not in WITHOUT_DISC
    return {"picture": picture, "disc": disc_line(values, picture) if has_disc else np.zeros((STEPS, 3))}


def add_sky(tree: bpy.types.NodeTree, values: dict[str, Any]) -> bpy.types.Node:
    """The node with the given properties as the whole world."""
    sky, background, output = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexSky", "Background", "OutputWorld"))
    for name, value in values.items():
        setattr(sky, name, value)
    tree.links.new(sky.outputs[0], background.inputs[0])
    tree.links.new(background.outputs[0], output.inputs[0])
    return sky


def gather_rows(tree: bpy.types.NodeTree, sky: bpy.types.Node) -> None:
    """Show elevation e = (pi / 2) s |s| at elevation (pi / 2) s, so that rows are denser near the horizon."""

    def math_node(operation: str, *inputs: Any) -> bpy.types.NodeSocket:
        node = tree.nodes.new("ShaderNodeMath")
        node.operation = operation
        for socket, value in zip(node.inputs, inputs, strict=False):
            if isinstance(value, float):
                socket.default_value = value
            else:
                tree.links.new(value, socket)
        return node.outputs[0]

    coordinates, separate, combine = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexCoord", "SeparateXYZ", "CombineXYZ"))
    tree.links.new(coordinates.outputs["Generated"], separate.inputs[0])
    x, y, z = separate.outputs
    s = math_node("MULTIPLY", math_node("ARCSINE", z), 2 / math.pi)
    elevation = math_node("MULTIPLY", math_node("MULTIPLY", s, math_node("ABSOLUTE", s)), math.pi / 2)
    azimuth, level = math_node("ARCTAN2", y, x), math_node("COSINE", elevation)
    tree.links.new(math_node("MULTIPLY", level, math_node("COSINE", azimuth)), combine.inputs[0])
    tree.links.new(math_node("MULTIPLY", level, math_node("SINE", azimuth)), combine.inputs[1])
    tree.links.new(math_node("SINE", elevation), combine.inputs[2])
    tree.links.new(combine.outputs[0], sky.inputs["Vector"])


def whole_sky(values: dict[str, Any]) -> np.ndarray:
    """(HEIGHT, WIDTH, 3) float32, the lowest row first: columns as in an environment texture, rows denser near the horizon."""
    scene = panorama()
    gather_rows(scene.world.node_tree, add_sky(scene.world.node_tree, values | {"sun_disc": False}))
    return look_around(scene, WIDTH, HEIGHT)


def disc_line(values: dict[str, Any], sky: np.ndarray) -> np.ndarray:
    """(STEPS, 3): colours of the disc without its darker edge, from the lowest elevation to the highest, both included.

    Up to Blender 4.5 the disc hides the sky; since 5.0 it is added to it.
    """
    scene = panorama()
    add_sky(scene.world.node_tree, values)
    centre, half = values["sun_elevation"], values["sun_size"] / 2
    share = (np.arange(STEPS) + 0.5) / STEPS
    elevations = centre + half * (2 * share - 1)
    seen = look(scene, 4, STEPS, (-BESIDE, BESIDE), (centre - half, centre + half)).mean(axis=1)
    behind = row_at(sky, elevations)
    disc = seen - behind if bpy.app.version >= (5, 0) else np.where(np.abs(seen - behind) > 1e-3 * behind, seen, 0)
    disc = disc.clip(0) / (1 - LIMB * (1 - np.sqrt(1 - (2 * share - 1) ** 2)))[:, None]
    return np.stack([np.interp(np.linspace(0, 1, STEPS), share, c) for c in disc.T], axis=1)


def row_at(sky: np.ndarray, elevations: np.ndarray) -> np.ndarray:
    """(N, 3): the sky's colours towards +y."""
    s = elevations * (2 / math.pi)
    rows = (0.5 + 0.5 * np.copysign(np.sqrt(np.abs(s)), s)) * HEIGHT - 0.5
    column = sky[:, WIDTH // 4 - 1 : WIDTH // 4 + 1].mean(axis=1)
    return np.stack([np.interp(rows, np.arange(HEIGHT), c) for c in column.T], axis=1)


# --- anything else ---------------------------------------------------------------------------------------------------


def node(job: dict[str, Any]) -> dict[str, np.ndarray]:
    """The output of a world's node in all directions."""
    scene = panorama()
    with bpy.data.libraries.load(job["blend"]) as (_, wanted):
        wanted.worlds = [job["world"]]
    (scene.world,) = wanted.worlds
    if scene.world is None:
        raise RuntimeError(f"no world '{job['world']}' in {job['blend']}")
    scene.world.cycles.sampling_method = "NONE"
    tree, socket = scene.world.node_tree, brought_out(scene.world.node_tree, job["groups"], job)
    background, output = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Background", "OutputWorld"))
    tree.links.new(socket, background.inputs[0])
    tree.links.new(background.outputs[0], output.inputs[0])
    for other in tree.nodes:
        if other.bl_idname == output.bl_idname:
            other.is_active_output = other == output
    frame = math.floor(job["frame"])
    scene.frame_set(frame, subframe=job["frame"] - frame)
    return {"picture": look_around(scene, ACROSS, ACROSS // 2)}


def brought_out(tree: bpy.types.NodeTree, groups: list[str], job: dict[str, Any]) -> bpy.types.NodeSocket:
    """The job's output, linked through all groups around it to the top level."""
    if not groups:
        return next(socket for socket in tree.nodes[job["node"]].outputs if socket.identifier == job["output"])
    group = tree.nodes[groups[0]]
    inner = group.node_tree
    socket = brought_out(inner, groups[1:], job)
    name = inner.interface.new_socket("Picture", in_out="OUTPUT", socket_type="NodeSocketColor").identifier
    end = next(n for n in inner.nodes if n.bl_idname == "NodeGroupOutput" and n.is_active_output)
    inner.links.new(socket, next(s for s in end.inputs if s.identifier == name))
    return next(s for s in group.outputs if s.identifier == name)


def main(arguments: list[str]) -> int:
    """Make the pictures of a job; gives the exit status, with the reason on stderr."""
    hold()
    job, out = json.loads(Path(arguments[0]).read_text(encoding="utf-8")), Path(arguments[1])
    tempfile.tempdir = str(out.parent)  # the parent process removes this folder, even if this process is killed
    try:
        pictures = sky(job["sky"]) if "sky" in job else node(job)
    except (RuntimeError, TypeError, AttributeError) as error:  # Blender cannot render, or refuses a value or a property
        print(" ".join(str(error).split()), file=sys.stderr)
        return 1
    arrays: dict[str, Any] = {name: picture.astype(np.float32) for name, picture in pictures.items()}
    with out.open("wb") as file:
        np.savez(file, **arrays)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[sys.argv.index("--") + 1 :]))
