"""Exports a scene of the open file by a render of it, because only an engine is given the depsgraph in render mode."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import Loss
from blender_rl_guiding.strings import fit

from .engine import Exporter
from .export.coverage import of_scene
from .export.text import read_names
from .neutral import first_layer, neutral


@read_names()
def captured(scene: bpy.types.Scene, view_layer: str = "") -> SceneData:
    """The scene as a render of it would export it, by its first view layer that renders or the named one.

    It is a render of a copy of the scene: the file and the last render stay as they were, and no render is heard of.
    InputError as in `export`, or what Blender itself has against rendering.
    """
    if scene.camera is None:
        raise InputError(f"scene '{scene.name}' has no camera (Properties > Scene > Camera)")
    copy = scene.copy()
    name = copy.name
    try:
        with _unheard(), exporting(copy, view_layer) as exported:
            return _renamed(exported(), name, scene.name)
    except InputError as error:
        raise InputError(str(error).replace(name, scene.name)) from error
    finally:
        bpy.data.scenes.remove(copy)


def _renamed(data: SceneData, copy: str, name: str) -> SceneData:
    """The scene under its own name instead of its copy's."""
    losses = (Loss(*(text.replace(copy, name) for text in (loss.object, loss.where, loss.detail))) for loss in data.coverage)
    return replace(data, name=fit(data.name.replace(copy, name)), coverage=tuple(losses))


@contextmanager
def exporting(scene: bpy.types.Scene, view_layer: str = "") -> Iterator[Callable[[], SceneData]]:
    """Yields a function that exports the scene as it is at each call, by its first view layer that renders or the named one.

    The scene's settings become neutral.
    """
    outcome: list[SceneData] = []

    class Capture(Exporter):
        """Keeps the scene; the image stays black."""

        bl_idname = "RL_GUIDED_CAPTURE"
        bl_label = "RL Guided Capture"

        def deliver(self, scene: SceneData) -> None:
            outcome.append(scene)

    def exported() -> SceneData:
        outcome.clear()
        neutral(scene)  # each time: the settings may be animated, too
        scene.render.engine = Capture.bl_idname
        render(scene, layer)
        if not outcome:
            raise InputError(f"Blender has not rendered scene '{scene.name}'")
        return replace(outcome[0], coverage=(*own, *(loss for loss in outcome[0].coverage if loss not in own)))

    layer = view_layer or first_layer(scene)
    if not layer:
        raise InputError(f"scene '{scene.name}' has no view layer that renders (Properties > View Layer > Use for Rendering)")
    own = tuple(of_scene(scene, scene.view_layers[layer]))  # told before it is not to be seen any more
    bpy.utils.register_class(Capture)
    try:
        yield exported
    finally:
        bpy.utils.unregister_class(Capture)  # at once: it is not for the user's menu, and Blender 4.5 would hang at exit


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
