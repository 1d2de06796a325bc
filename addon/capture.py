"""Exports a scene of the open file: it starts a render of the scene, see `exporter`."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.bundle import save
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import Loss
from blender_rl_guiding.scene.framing import viewed
from blender_rl_guiding.scene.view import View
from blender_rl_guiding.strings import fit, one_line

from .export.coverage import of_scene, summary
from .export.text import read_names
from .exporter import Exporter
from .neutral import first_layer, neutral


@read_names()
def captured(scene: bpy.types.Scene) -> SceneData:
    """The scene as a render would export it, with the first view layer that renders.

    A copy of the scene is rendered: the file and the last render stay as they are.
    InputError as in `export`, or with Blender's own reason not to render.
    """
    if scene.camera is None:
        raise InputError(f"scene '{scene.name}' has no camera (Properties > Scene > Camera)")
    copy = scene.copy()
    name = copy.name
    try:
        with exporting(copy) as export:
            return _renamed(export(), name, scene.name)
    except InputError as error:
        raise InputError(str(error).replace(name, scene.name)) from error
    finally:
        bpy.data.scenes.remove(copy)


def _renamed(data: SceneData, copy: str, name: str) -> SceneData:
    """The scene with its own name instead of the name of its copy."""
    losses = (Loss(*(text.replace(copy, name) for text in (loss.object, loss.where, loss.detail))) for loss in data.coverage)
    return replace(data, name=fit(data.name.replace(copy, name)), coverage=tuple(losses))


@read_names()
def exported(scene: bpy.types.Scene, view: View) -> SceneData:
    """The scene of a file that `views.opened` opened at this view. The scene's settings become neutral."""
    with exporting(scene) as export:
        return viewed(export(), view)


def write(scene: SceneData, bundle: Path, blend: Path, *, strict: bool) -> None:
    """Save the bundle of a file. With `strict`, InputError if there is any loss."""
    if strict and scene.coverage:
        raise InputError(f"{blend.name}: {summary(scene.coverage)}")
    save(scene, bundle)


@contextmanager
def exporting(scene: bpy.types.Scene) -> Iterator[Callable[[], SceneData]]:
    """Yields a function that exports the scene at the frame of its argument, with the first view layer that renders.

    The scene's settings become neutral. InputError if no view layer renders.
    """
    outcome: list[SceneData] = []

    class Capture(Exporter):
        """Keeps the scene; the image stays black."""

        bl_idname = "RL_GUIDED_CAPTURE"
        bl_label = "RL Guided Capture"

        def deliver(self, scene: SceneData) -> None:
            outcome.append(scene)

    def export() -> SceneData:
        outcome.clear()
        neutral(scene)  # at each call, because an animation may have changed these settings again
        scene.render.engine = Capture.bl_idname
        with _unheard():
            render(scene, layer)
        if not outcome:
            raise InputError(f"Blender has not rendered scene '{scene.name}'")
        return replace(outcome[0], coverage=(*own, *(loss for loss in outcome[0].coverage if loss not in own)))

    layer = first_layer(scene)
    if not layer:
        raise InputError(f"scene '{scene.name}' has no view layer that renders (Properties > View Layer > Use for Rendering)")
    own = tuple(of_scene(scene, scene.view_layers[layer]))  # before `neutral`, which would hide these losses
    bpy.utils.register_class(Capture)
    try:
        yield export
    finally:
        bpy.utils.unregister_class(Capture)  # immediately: users should not see it in the menu, and Blender 4.5 would hang at exit


@contextmanager
def _unheard() -> Iterator[None]:
    """In this block Blender calls no render handler of any add-on, because the user did not start a render."""
    lists = [getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers) if name.startswith("render_")]
    kept = [[*handlers] for handlers in lists]
    for handlers in lists:
        handlers.clear()
    try:
        yield
    finally:
        for handlers, before in zip(lists, kept, strict=True):
            handlers[:] = before


def render(scene: bpy.types.Scene, view_layer: str) -> None:
    """Render a still image with the scene's engine, in this thread. InputError with the reason from the engine or from Blender."""
    try:
        bpy.ops.render.render(scene=scene.name, layer=view_layer)
    except RuntimeError as error:
        raise InputError(one_line(error).removeprefix("Error: ")) from error
