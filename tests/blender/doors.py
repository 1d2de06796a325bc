"""Renders scenes with misleading settings through every door: python doors.py FOLDER, in the Python of any Blender.

FOLDER/found.json has, for each case by name, the result or error of each door. "capture", "export" and "frame": the key of the bundle.
"cycles": a digest of the reference's pixels. "files": the names of all other files that were written.
"""

import hashlib
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import addon
from addon import cycles_reference, neutral
from addon.capture import captured, exporting
from addon.neutral import first_layer
from addon.views import opened
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.view import View

FOLDER = Path(sys.argv[-1])
WRITTEN = FOLDER / "written"
Case = Callable[[bpy.types.Scene], None]
# For settings of the tables: a value that is not the neutral one. Switches that are not in this list are toggled.
OTHERS: dict[str, Any] = {
    "media_type": "VIDEO",
    "file_format": "PNG",
    "color_mode": "BW",
    "color_depth": "16",
    "exr_codec": "DWAA",
    "views_format": "STEREO_3D",
    "color_management": "OVERRIDE",
    "samples": 1,
    "sample_clamp_direct": 0.01,
    "sample_clamp_indirect": 0.01,
    "blur_glossy": 10.0,
    "light_sampling_threshold": 1.0,
    "scrambling_distance": 0.1,
    "time_limit": 1e-6,
    "sample_offset": 5,
    "seed": 7,
}


def stage() -> bpy.types.Scene:
    """A metal cube on a floor, under a lamp and a grey world."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 32, 24, 50
    bpy.ops.mesh.primitive_plane_add(size=6, location=(0, 0, -1))
    bpy.ops.mesh.primitive_cube_add(size=1, rotation=(0.3, 0.2, 0.5))
    material = bpy.data.materials.new("Metal")
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        material.use_nodes = scene.world.use_nodes = True
    metal = material.node_tree.nodes["Principled BSDF"].inputs
    metal["Metallic"].default_value, metal["Roughness"].default_value = 1.0, 0.1
    bpy.context.object.data.materials.append(material)
    for data, place, turn in (
        (bpy.data.lights.new("Lamp", "POINT"), (1, -1, 2), (0, 0, 0)),
        (bpy.data.cameras.new("Camera"), (0, -4, 1.5), (1.25, 0, 0)),
    ):
        thing = bpy.data.objects.new(data.name, data)
        thing.location, thing.rotation_euler = place, turn
        scene.collection.objects.link(thing)
    bpy.data.lights["Lamp"].energy = 100
    scene.camera = bpy.data.objects["Camera"]
    return scene


def switched(table: dict[str, Any], owner: Callable[[bpy.types.Scene], Any]) -> dict[str, Case]:
    """A case for each setting of a table, if this Blender has it."""

    def case(name: str, value: Any) -> Case:
        other = OTHERS.get(name, not value)
        return lambda scene: setattr(owner(scene), name, other)

    there = owner(stage()).bl_rna.properties
    return {name: case(name, value) for name, value in table.items() if name in there and value is not None}


def image_settings(scene: bpy.types.Scene) -> Any:
    """Image settings of an EXR. With other formats, most of them could not be set."""
    settings = scene.render.image_settings
    settings.file_format = "OPEN_EXR"
    return settings


def compositor(scene: bpy.types.Scene) -> None:
    """A compositor that changes the image and writes a file."""
    if bpy.app.version >= (5, 0):
        scene.compositing_node_group = tree = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        output, file = tree.nodes.new("NodeGroupOutput"), tree.nodes.new("CompositorNodeOutputFile")
        file.directory, file.file_name = str(WRITTEN), "file"
        file.file_output_items.new("RGBA", "Image")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
        output, file = tree.nodes.new("CompositorNodeComposite"), tree.nodes.new("CompositorNodeOutputFile")
        file.base_path = str(WRITTEN)
    layers, invert = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeInvert")
    tree.links.new(layers.outputs[0], invert.inputs["Color"])
    tree.links.new(invert.outputs[0], output.inputs[0])
    tree.links.new(layers.outputs[0], file.inputs[0])


def sequencer(scene: bpy.types.Scene) -> None:
    """A sequencer with a strip, which would replace the scene's image."""
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    strips.new_scene(name="Strip", scene=scene, channel=1, frame_start=1)


def stamp(scene: bpy.types.Scene) -> None:
    scene.render.use_stamp = scene.render.use_stamp_note = True
    scene.render.stamp_note_text, scene.render.stamp_background = "note", (1, 0, 0, 1)


def views(scene: bpy.types.Scene) -> None:
    """Views for cameras that do not exist."""
    scene.render.use_multiview, scene.render.views_format = True, "MULTIVIEW"
    for view in scene.render.views:
        view.camera_suffix = "_none"


def overrides(scene: bpy.types.Scene) -> None:
    layer = scene.view_layers[0]
    layer.material_override = bpy.data.materials.new("Override")
    if hasattr(layer, "world_override"):
        layer.world_override = bpy.data.worlds.new("Override")


def grease_pencil(scene: bpy.types.Scene) -> None:
    bpy.ops.object.grease_pencil_add(type="STROKE")


def layers(scene: bpy.types.Scene) -> None:
    """Three view layers; the third is off. Blender is set to render only the window's layer."""
    scene.view_layers.new("Second")
    scene.view_layers.new("Third").use = False
    scene.render.use_single_layer = True


def animated(scene: bpy.types.Scene) -> None:
    """Values from a driver without a script, and from a curve."""
    scene.cycles.driver_add("seed").driver.expression = "frame"
    scene.cycles.samples = 1
    scene.cycles.keyframe_insert("samples", frame=1)


def scripts(scene: bpy.types.Scene) -> None:
    """Scripts: a text that runs when the file opens, a handler, a driver, and Freestyle."""
    WRITTEN.mkdir(exist_ok=True)
    code = (
        f"import bpy\nbpy.app.handlers.render_pre.append(lambda *_: open({str(WRITTEN / 'h')!r}, 'w'))\nopen({str(WRITTEN / 't')!r}, 'w')"
    )
    for name in ("text.py", "style.py"):
        text = bpy.data.texts.new(name)
        text.write(code)
        text.use_module = name == "text.py"
    scene.render.use_freestyle = True
    style = scene.view_layers[0].freestyle_settings
    style.mode = "SCRIPT"
    style.modules.new().script = bpy.data.texts["style.py"]
    driver = scene.cycles.driver_add("seed").driver
    driver.expression = f"len(open({str(WRITTEN / 'd')!r}, 'w').name)"


def output(scene: bpy.types.Scene) -> None:
    scene.render.filepath, scene.render.use_overwrite, scene.render.use_placeholder = str(WRITTEN / "output"), False, True


def look(scene: bpy.types.Scene) -> None:
    scene.view_settings.view_transform, scene.view_settings.exposure, scene.render.dither_intensity = "Standard", 3.0, 2.0
    scene.render.use_persistent_data, scene.render.use_high_quality_normals = True, True


CASES: dict[str, Case] = {
    "clean": lambda _: None,
    **switched(neutral.PIPELINE, lambda scene: scene.render),
    **switched(neutral._LAYER, lambda scene: scene.view_layers[0]),
    **switched(neutral.CYCLES, lambda scene: scene.cycles),
    **{f"image {name}": case for name, case in switched(neutral._IMAGE, image_settings).items()},
    **{case.__name__: case for case in (compositor, sequencer, stamp, views, overrides, layers, animated, scripts, output, look)},
}
if hasattr(bpy.ops.object, "grease_pencil_add") and bpy.app.version >= (5, 0):
    CASES["grease pencil"] = grease_pencil


def through_all(blend: Path) -> dict[str, str]:
    """The result of each door for a file."""
    found = {}

    def tell(door: str, made: Callable[[], str]) -> None:
        try:
            found[door] = made()
        except (InputError, RuntimeError) as error:
            found[door] = f"error: {error}"

    scene = opened(blend, View())
    tell("capture", lambda: captured(scene).key)
    with exporting(scene) as exported:
        tell("export", lambda: exported().key)
        scene.frame_set(1)
        tell("frame", lambda: exported().key)
    tell("cycles", lambda: reference(blend))
    found["files"] = sorted(path.name for path in WRITTEN.glob("*")) if WRITTEN.exists() else []
    return found


def reference(blend: Path) -> str:
    """A reference by Cycles in this process, as by `cycles_reference.main`."""
    out = blend.with_suffix(".exr")
    bpy.ops.wm.open_mainfile(filepath=str(blend), load_ui=False, use_scripts=False)
    scene = bpy.context.scene
    cycles_reference.prepare(scene, 2)
    scene.render.filepath = str(out)
    bpy.ops.render.render(layer=first_layer(scene), write_still=True)
    image = bpy.data.images.load(str(out))
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return hashlib.sha256(pixels.tobytes()).hexdigest()


def main() -> None:
    addon.register()
    found = {}
    for name, case in CASES.items():
        print("case", name, flush=True)  # names the case if Blender crashes
        blend = FOLDER / "scene.blend"  # its name is the scene's name
        case(stage())
        bpy.ops.wm.save_as_mainfile(filepath=str(blend))
        found[name] = through_all(blend)
    addon.unregister()
    (FOLDER / "found.json").write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
