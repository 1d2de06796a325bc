"""Measures shader nodes in Cycles: python shading_oracle.py CASES.json ATTRIBUTES.npz RESULT.npy.

A case is a node with settings and inputs. The node colours a row of squares; each square is a pixel. Attributes have one value for each
square. An input may also be the "position". The result is the node's output, (cases, squares, 3) float32.
Runs in a process of its own, as the bpy module allows one session in each.
"""

import json
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np


def _socket(sockets: Any, identifier: str) -> bpy.types.NodeSocket:
    return next(socket for socket in sockets if socket.identifier == identifier)


def material(case: dict[str, Any], images: dict[str, bpy.types.Image]) -> bpy.types.Material:
    """A material that emits the colour of the case's output."""
    made = bpy.data.materials.new("Case")
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    node = nodes.new(case["node"])
    for name, value in case["set"].items():
        setattr(node, name, images[value] if name == "image" else value)
    for name, value in case["inputs"].items():
        socket = _socket(node.inputs, name)
        if value == "position":
            links.new(nodes.new("ShaderNodeNewGeometry").outputs["Position"], socket)
        elif isinstance(value, str):
            attribute = nodes.new("ShaderNodeAttribute")
            attribute.attribute_name = value
            links.new(attribute.outputs["Fac" if len(value) > 1 else "Vector"], socket)
        else:
            socket.default_value = value
    emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    links.new(_socket(node.outputs, case["output"]), emission.inputs["Color"])
    if "beside" in case:  # another output has a link, too, but this link has no effect
        test = nodes.new("ShaderNodeMath")
        test.operation, test.inputs[1].default_value = "LESS_THAN", 1000.0
        links.new(_socket(node.outputs, case["beside"]), test.inputs[0])
        links.new(test.outputs["Value"], emission.inputs["Strength"])
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return made


def squares(rows: int, columns: int, attributes: dict[str, np.ndarray]) -> bpy.types.Object:
    """A sheet of unit squares from the origin along x and -y. Each row has its material; otherwise rows are equal."""
    i, j = np.mgrid[0:rows, 0:columns]
    corners = np.stack([np.stack([j + x, -i - y], axis=-1) for x, y in ((0, 1), (1, 1), (1, 0), (0, 0))], axis=2)
    vertices = np.concatenate([corners.reshape(-1, 2), np.zeros((rows * columns * 4, 1))], axis=1)
    mesh = bpy.data.meshes.new("Squares")
    mesh.from_pydata(vertices.tolist(), [], np.arange(len(vertices)).reshape(-1, 4).tolist())
    mesh.uv_layers.new()  # a unit square for each face, u along x
    mesh.polygons.foreach_set("material_index", i.ravel().astype(np.int32))
    for name, values in attributes.items():  # attributes with names of one letter are vectors
        kind, field = ("FLOAT_VECTOR", "vector") if len(name) == 1 else ("FLOAT", "value")
        mesh.attributes.new(name, kind, "FACE").data.foreach_set(field, np.tile(values, (rows, 1) if len(name) == 1 else rows).ravel())
    return bpy.data.objects.new("Squares", mesh)


def prepare(rows: int, columns: int) -> bpy.types.Scene:
    """An empty scene seen from straight above, with a pixel for each square."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = columns, rows
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.cycles.samples, scene.cycles.pixel_filter_type = 1, "BOX"
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0.0
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", max(rows, columns)
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.location = (columns / 2, -rows / 2, 1)
    scene.collection.objects.link(scene.camera)
    return scene


def picture(scene: bpy.types.Scene, path: Path) -> np.ndarray:
    """The rendered image, (H, W, 3), top row first."""
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    texels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(texels)
    return texels.reshape(image.size[1], image.size[0], 4)[::-1, :, :3]


def main(cases: list[dict[str, Any]], attributes: dict[str, np.ndarray], folder: Path) -> np.ndarray:
    """All cases in one render."""
    columns = len(next(iter(attributes.values())))
    scene = prepare(len(cases), columns)
    images = {case["set"]["image"]: bpy.data.images.load(case["set"]["image"]) for case in cases if "image" in case["set"]}
    sheet = squares(len(cases), columns, attributes)
    for case in cases:
        sheet.data.materials.append(material(case, images))
    scene.collection.objects.link(sheet)
    return picture(scene, folder / "image.exr")


if __name__ == "__main__":
    listed, given, result = (Path(argument) for argument in sys.argv[1:])
    np.save(result, main(json.loads(listed.read_text()), dict(np.load(given)), result.parent))
