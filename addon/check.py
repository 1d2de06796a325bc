"""The operator Check Scene: what a render would say of the scene, without one.

Only a render engine is given the depsgraph that renders see, so there is a render, by an engine that exports and nothing else: of a
copy of the scene, because each scene has a render result of its own, and the user's stays.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.description import Loss

from .coverage import show
from .export.coverage import of_scene
from .export.scene import export


def check(scene: bpy.types.Scene) -> tuple[tuple[Loss, ...], str]:
    """What of a scene cannot be rendered as it is, and what makes it impossible to render, empty if nothing does."""
    found: list[tuple[tuple[Loss, ...], str]] = []

    class Checker(bpy.types.RenderEngine):
        """Exports; registered for this one render, or users could choose it."""

        bl_idname = "RL_GUIDED_CHECK"
        bl_label = "RL Guided Check"

        def render(self, depsgraph: bpy.types.Depsgraph) -> None:
            if found:
                return  # a second view layer or eye; only the first is rendered
            try:
                found.append((export(depsgraph).coverage, ""))
            except InputError as error:
                found.append(((), str(error)))

    bpy.utils.register_class(Checker)
    try:
        with _unheard(), _copied(scene) as copy:
            copy.render.engine = Checker.bl_idname
            copy.render.use_compositing = copy.render.use_sequencer = False
            copy.render.use_freestyle = False  # of a copied scene it crashes Blender 5.2
            bpy.ops.render.render(scene=copy.name)
            losses, fault = found[0]
            others = (loss for loss in losses if loss not in set(_of_settings(copy)))
            return (*_of_settings(scene), *others), fault.replace(copy.name, scene.name)
    except RuntimeError as error:  # Blender's own refusal
        return (), " ".join(str(error).removeprefix("Error: ").split())
    finally:
        bpy.utils.unregister_class(Checker)  # or Blender 4.5 hangs at exit


def _of_settings(scene: bpy.types.Scene) -> tuple[Loss, ...]:
    """What is lost of the settings of the scene itself, by its name."""
    layers = [layer for layer in scene.view_layers if layer.use] or scene.view_layers
    return tuple(of_scene(scene, layers[0]))


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


@contextmanager
def _copied(scene: bpy.types.Scene) -> Iterator[bpy.types.Scene]:
    """A scene of the same objects, for a while."""
    copy = scene.copy()
    try:
        yield copy
    finally:
        bpy.data.scenes.remove(copy)


class RLG_OT_check(bpy.types.Operator):
    """Fills the list of `coverage` for the present scene."""

    bl_idname = "rl_guided.check"
    bl_label = "Check Scene"
    bl_description = "List what of this scene cannot be rendered as it is. It is read as for a render, which takes a while if it is large"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return not bpy.app.is_job_running("RENDER")

    def execute(self, context: bpy.types.Context) -> set[str]:
        losses, fault = check(context.scene)
        show(context.scene.name, losses, fault)
        if fault:
            self.report({"WARNING"}, fault)
        return {"FINISHED"}


def register() -> None:
    """The operator."""
    bpy.utils.register_class(RLG_OT_check)


def unregister() -> None:
    """Undo `register`."""
    bpy.utils.unregister_class(RLG_OT_check)
