"""Operators that start and end long work: compare, show Q, cancel."""

# pyright: reportInvalidTypeForm=false

import os
from functools import partial
from pathlib import Path
from typing import Any

import bpy

from blender_rl_guiding import messages
from blender_rl_guiding.comparison import Comparison
from blender_rl_guiding.errors import InputError, check_writable
from blender_rl_guiding.schema import to_dict
from blender_rl_guiding.strings import printable

from .. import installation as environment
from ..areas import areas, largest
from ..capture import captured
from ..engine import machine
from ..properties import read
from . import results, running
from .properties import CHOSEN
from .steps import Cycles, working

PATIENCE = 0.5  # seconds that a step may wait if Blender has no window to keep responsive


def all_folders_of(comparison: bpy.types.PropertyGroup) -> Path:
    """The folder that contains the folders of all scenes. InputError if the .blend names a path outside of its own folder.

    The .blend may come from a stranger. A folder that the user has chosen since the file was opened is allowed.
    """
    folder = comparison.folder or "//"
    if folder.startswith("//") and not bpy.data.filepath:
        raise InputError("results go beside the .blend: save it first, or choose another folder for them")
    path = Path(os.path.abspath(bpy.path.abspath(folder)))
    own = os.path.realpath(os.path.dirname(bpy.data.filepath)) if bpy.data.filepath else None
    if bpy.path.abspath(folder) not in CHOSEN and not (own and Path(os.path.realpath(path)).is_relative_to(own)):
        raise InputError(f"the .blend has results go to {path}, outside of its own folder: if that is right, choose this folder again")
    return path


def folder_of(scene: bpy.types.Scene) -> Path:
    """The folder of a scene's comparison. InputError as in `all_folders_of`, or if the folder cannot be written."""
    path = all_folders_of(scene.rl_guiding_comparison) / bpy.path.clean_name(scene.name)
    check_writable(path)
    return path


def asked(scene: bpy.types.Scene) -> Comparison:
    """The comparison of the panel. InputError if it is not valid, or if the file of its reference is missing."""
    comparison = read(scene.rl_guiding_comparison, Comparison)
    if comparison.reference == "FILE" and not comparison.reference_file.is_file():
        raise InputError(f"the reference is not at {comparison.reference_file}: choose an EXR image")
    return comparison


def reference_of(scene: bpy.types.Scene, comparison: Comparison) -> Cycles | None:
    """The renderer of the reference if it is Cycles, otherwise None."""
    return Cycles(scene, comparison.reference_spp) if comparison.reference == "CYCLES" else None


def scene_of(uid: int) -> bpy.types.Scene:
    """The scene with that session number, also after undo. InputError if the scene is gone."""
    for scene in bpy.data.scenes:
        if scene.session_uid == uid:
            return scene
    raise InputError("the scene that was compared is gone; its results are in their folder")


class Background(bpy.types.Operator):
    """Starts long work and returns. Without a window it does all of the work. Only subclasses are registered."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if running.STATE.work:
            cls.poll_message_set(f"{running.STATE.work.label} is under way")
            return False
        if bpy.app.is_job_running("RENDER"):
            cls.poll_message_set("Blender is rendering: wait for the end of the render")
            return False
        return True

    def work(self, context: bpy.types.Context, patience: float) -> tuple[str, running.Steps, running.Finish]:
        """Label, steps and finish of the work. InputError if the work cannot begin."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            if not bpy.app.background:
                running.start(*self.work(context, 0.0))
                return {"FINISHED"}
            self.report({"INFO"}, running.complete(*self.work(context, PATIENCE), self._tell))
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def _tell(self, status: running.Status) -> None:
        if status.note:
            self.report({"INFO"}, status.note)


class RLG_OT_compare(Background):
    """Render the scene by every method of the list in the background, and measure each against the reference.

    Runs that are done already are kept.
    """

    bl_idname = "rl_guided.compare"
    bl_label = "Compare"

    def work(self, context: bpy.types.Context, patience: float) -> tuple[str, running.Steps, running.Finish]:
        scene, python = context.scene, environment.python()
        folder, comparison, uid = folder_of(scene), asked(scene), scene.session_uid
        file = Path(bpy.data.filepath).name or "an unsaved file"
        command = printable(f"Blender {bpy.app.version_string}, Compare: scene '{scene.name}' of {file}")
        job = partial(messages.Compare, comparison=to_dict(comparison), out=str(folder), command=command, machine=machine(scene.render))
        data = captured(scene)
        steps = working(python, data, job, patience, reference_of(scene, comparison))

        def finish(outcome: dict[str, Any]) -> str:
            line = results.store(scene_of(uid), outcome)
            undo_push("Compare Methods")
            return line

        return "Comparison", steps, finish


class RLG_OT_inspect(Background):
    """Render by the active method, and show what it has learnt of the light that arrives at the chosen pixel."""

    bl_idname = "rl_guided.inspect"
    bl_label = "Show Q"

    def work(self, context: bpy.types.Context, patience: float) -> tuple[str, running.Steps, running.Finish]:
        scene, active = context.scene, context.scene.rl_guiding_comparison.active_method
        comparison = read(scene.rl_guiding_comparison, Comparison)
        name, _ = comparison.methods[max(0, min(active, len(comparison.methods) - 1))]
        settings, out = to_dict(comparison.compared()[name]), folder_of(scene) / "learnt" / name
        job = partial(messages.Inspect, settings=settings, out=str(out), pixel=comparison.pixel(), machine=machine(scene.render))
        steps = working(environment.python(), captured(scene), job, patience)

        def finish(outcome: dict[str, Any]) -> str:
            shown = []
            for path in outcome["pictures"]:
                called = f"{name} {Path(path).stem}"
                shown.append(results.opened(path, called, bpy.data.images.get(called)))
                shown[-1].use_fake_user = True  # a fake user: the image stays in the file without a reference to it
            show(shown[-1])
            undo_push("Show Q")
            return f"See the images '{shown[-1].name}' and '{shown[0].name}'"

        return f"Q of {name}", steps, finish


def show(image: bpy.types.Image) -> bool:
    """Show an image in the largest image editor that there is; False if there is none."""
    editors = list(areas("IMAGE_EDITOR"))
    if editors:
        largest(editors).spaces.active.image = image
    return bool(editors)


def undo_push(message: str) -> None:
    """Push an undo step, so that the user's next Ctrl+Z does not remove the results."""
    if windows := bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=windows[0]):
            bpy.ops.ed.undo_push(message=message)


class RLG_OT_cancel(bpy.types.Operator):
    """End the work under way. Finished runs are kept: the next comparison goes on from there."""

    bl_idname = "rl_guided.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return running.STATE.work is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        running.cancel()
        return {"FINISHED"}


_CLASSES = (RLG_OT_compare, RLG_OT_inspect, RLG_OT_cancel)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
