"""Exports a scene of the open file from the user interface or a command, and leaves the file and the last render as they were."""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import SceneData

from .engine import Exporter


def captured(scene: bpy.types.Scene, view_layer: str = "") -> SceneData:
    """The scene as a render of it would export it, by its first view layer that renders or the named one.

    Only an engine is given a depsgraph in render mode, so this is a render, of a copy of the scene: the original keeps its engine and
    its render result. InputError as in `export`, or what Blender itself has against rendering.
    """
    if scene.camera is None:
        raise InputError(f"scene '{scene.name}' has no camera (Properties > Scene > Camera)")
    outcome: list[SceneData] = []

    class Capture(Exporter):
        """Keeps the scene; the image stays black."""

        bl_idname = "RL_GUIDED_CAPTURE"
        bl_label = "RL Guided Capture"

        def deliver(self, scene: SceneData) -> None:
            outcome.append(scene)

    bpy.utils.register_class(Capture)
    try:
        with copied(scene) as copy:
            copy.render.engine = Capture.bl_idname
            render(copy, view_layer)
    finally:
        bpy.utils.unregister_class(Capture)  # at once: it is not for the user's menu
    return outcome[0]


@contextmanager
def copied(scene: bpy.types.Scene) -> Iterator[bpy.types.Scene]:
    """A copy of a scene with the same objects, without compositing and sequencer; gone after the block."""
    copy = scene.copy()
    try:
        copy.render.use_compositing = copy.render.use_sequencer = False
        yield copy
    finally:
        bpy.data.scenes.remove(copy)


def render(scene: bpy.types.Scene, view_layer: str = "") -> None:
    """Render a still by the scene's engine, here and now. InputError with what the engine or Blender reported."""
    try:
        bpy.ops.render.render(scene=scene.name, layer=view_layer)
    except RuntimeError as error:
        raise InputError(" ".join(str(error).removeprefix("Error: ").split())) from error
