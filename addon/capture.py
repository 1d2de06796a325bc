"""Exports a scene of the open file from the user interface or a command, and leaves the file and the last render as they were."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import Loss

from .engine import Exporter
from .export.coverage import of_scene


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
            name, copy.render.engine = copy.name, Capture.bl_idname
            try:
                render(copy, view_layer)
            except InputError as error:
                raise InputError(str(error).replace(name, scene.name)) from error
    finally:
        bpy.utils.unregister_class(Capture)  # at once: it is not for the user's menu, and Blender 4.5 would hang at exit
    return _of_original(outcome[0], name, scene, view_layer)


def _of_original(data: SceneData, copy: str, scene: bpy.types.Scene, view_layer: str) -> SceneData:
    """The scene under its own name instead of its copy's, with what is lost of settings that the copy does not have."""
    layers = [scene.view_layers[view_layer]] if view_layer else [*(layer for layer in scene.view_layers if layer.use), *scene.view_layers]
    own = tuple(of_scene(scene, layers[0]))
    losses = (Loss(*(text.replace(copy, scene.name) for text in (loss.object, loss.where, loss.detail))) for loss in data.coverage)
    return replace(data, name=data.name.replace(copy, scene.name), coverage=(*own, *(loss for loss in losses if loss not in own)))


@contextmanager
def copied(scene: bpy.types.Scene) -> Iterator[bpy.types.Scene]:
    """A copy of a scene with the same objects, without compositing and sequencer; gone after the block, in which no render is heard of."""
    copy = scene.copy()
    copy.render.use_compositing = copy.render.use_sequencer = False
    copy.render.use_freestyle = False  # of a copied scene it crashes Blender 5.2
    try:
        with _unheard():
            yield copy
    finally:
        bpy.data.scenes.remove(copy)


@contextmanager
def _unheard() -> Iterator[None]:
    """No render handler of anyone runs for a while: the user asked for no render."""
    lists = [getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers) if name.startswith("render_")]
    kept = [[*handlers] for handlers in lists]
    for handlers in lists:
        handlers.clear()
    try:
        yield
    finally:
        for handlers, before in zip(lists, kept, strict=True):
            handlers[:] = before


def render(scene: bpy.types.Scene, view_layer: str = "") -> None:
    """Render a still by the scene's engine, here and now. InputError with what the engine or Blender reported."""
    try:
        bpy.ops.render.render(scene=scene.name, layer=view_layer)
    except RuntimeError as error:
        raise InputError(" ".join(str(error).removeprefix("Error: ").split())) from error
