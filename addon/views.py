"""Opens a .blend with the scene, camera, frame and size of a `View`. The file on disk stays unchanged."""

import glob
import hashlib
import re
from collections.abc import Iterator
from pathlib import Path

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.view import AUTO, View
from blender_rl_guiding.strings import one_line


def opened(blend: Path, view: View) -> bpy.types.Scene:
    """The scene of a file at a view. Scripts in the file do not run. If a name is missing, the InputError lists the existing names."""
    try:
        bpy.ops.wm.open_mainfile(filepath=str(blend.absolute()), load_ui=False, use_scripts=False)
    except RuntimeError as error:
        reason = one_line(error).rpartition(": ")[2]
        raise InputError(f"Blender cannot open {blend}, it may be damaged: {reason}") from error
    scene = _scene(blend, view.scene) if view.scene else bpy.context.scene
    bpy.context.window.scene = scene  # otherwise objects would keep the state of another scene's frame
    if view.frame is not None:
        scene.frame_set(view.frame)  # a marker may switch the camera
    _set_size(scene.render, view)
    _set_camera(blend, scene, view.camera)
    return scene


def _scene(blend: Path, name: str) -> bpy.types.Scene:
    if name not in bpy.data.scenes:
        raise InputError(f"{blend.name} has no scene '{name}', but {_listed(bpy.data.scenes)}")
    return bpy.data.scenes[name]


def _set_size(render: bpy.types.RenderSettings, view: View) -> None:
    if view.resolution:
        render.resolution_x, render.resolution_y = view.resolution
        render.resolution_percentage = 100
    if view.percentage:
        render.resolution_percentage = view.percentage


def _set_camera(blend: Path, scene: bpy.types.Scene, name: str | None) -> None:
    cameras = [thing for thing in scene.objects if thing.type == "CAMERA"]
    if name == AUTO:  # a temporary camera: `framing` places the camera after the scene has been read
        chosen = [bpy.data.objects.new(AUTO, bpy.data.cameras.new(AUTO))]
        scene.render.use_border = False  # the region was chosen for another camera
        if hasattr(scene, "cycles"):  # otherwise Simplify would cull with the temporary camera
            scene.cycles.use_camera_cull = scene.cycles.use_distance_cull = False
    elif name:
        chosen = [thing for thing in cameras if thing.name == name]
        if not chosen:
            raise InputError(f"{blend.name}: scene '{scene.name}' has no camera '{name}', but {_listed(cameras)}; or --camera {AUTO}")
    elif scene.camera and scene.camera.type == "CAMERA":
        return
    else:
        others = f", --camera NAME takes one of {_listed(cameras)}" if cameras else ""
        raise InputError(f"{blend.name}: scene '{scene.name}' has no camera: --camera {AUTO} frames all that renders{others}")
    for marker in scene.timeline_markers:
        marker.camera = None  # otherwise markers would switch the camera at the next frame
    scene.camera = chosen[0]


def _listed(things: list[bpy.types.ID]) -> str:
    return ", ".join(f"'{thing.name}'" for thing in things) or "none at all"


def source_key(blend: Path, view: View) -> str:
    """SHA-256 of the open file, of size and date of each referenced file, and of the view. Frames with equal keys are equal."""
    digest = hashlib.sha256(f"{view.to_json()} {bpy.app.version_string}".encode())
    with blend.open("rb") as file:
        while chunk := file.read(1 << 20):
            digest.update(chunk)
    for path in sorted({*map(Path, bpy.utils.blend_paths(absolute=True)), *_pictures()}):
        digest.update(_stamp(path).encode())
    return digest.hexdigest()


def _pictures() -> Iterator[Path]:
    """All files of sequences and tiled images; `blend_paths` has only one of them or a pattern."""
    for image in bpy.data.images:
        path = Path(bpy.path.abspath(image.filepath, library=image.library))
        name = glob.escape(path.name)
        if image.source == "TILED":
            yield from path.parent.glob(re.sub("<UDIM>|<UVTILE>", "*", name))
        elif image.source == "SEQUENCE":
            yield from path.parent.glob(re.sub(r"\d+(?=\D*$)", "*", name.removesuffix(path.suffix)) + path.suffix)


def _stamp(path: Path) -> str:
    try:
        about = path.stat()
    except OSError:
        return f"{path} missing\n"
    return f"{path} {about.st_size} {about.st_mtime_ns}\n"
