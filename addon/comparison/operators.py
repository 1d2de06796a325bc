"""Compare, show what is learnt, cancel: what starts and ends long work."""

# pyright: reportInvalidTypeForm=false

import os
from pathlib import Path
from typing import Any

import bpy

from blender_rl_guiding.errors import InputError, check_writable
from blender_rl_guiding.schema import to_dict
from blender_rl_guiding.strings import printable

from .. import installation as environment
from ..capture import captured
from ..engine import machine
from . import methods, results, running
from .properties import CHOSEN
from .steps import Cycles, working

PATIENCE = 0.5  # seconds that a step waits where nobody else is kept waiting


def all_folders_of(comparison: bpy.types.PropertyGroup) -> Path:
    """Where the folders of all scenes are. InputError where the .blend, which may be a stranger's, names a place outside of its own folder.

    Whoever has chosen that place since the file was opened, knows it.
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
    """Where a comparison's files go. InputError where nothing can be written there, or nobody has chosen it."""
    path = all_folders_of(scene.rl_guiding_comparison) / bpy.path.clean_name(scene.name)
    check_writable(path)
    return path


def job_of(scene: bpy.types.Scene, folder: Path) -> dict[str, Any]:
    """The worker's job "compare", as the panel asks for it, without a scene. InputError where something does not fit."""
    comparison = scene.rl_guiding_comparison
    compared = methods.all_of(comparison)
    first = next(iter(compared.values())).seed
    reference: dict[str, Any] = {"spp": comparison.reference_spp}
    if comparison.reference == "FILE":
        file = Path(bpy.path.abspath(comparison.reference_file))
        if not file.is_file():
            raise InputError(f"the reference is not at {file}: choose an EXR image")
        reference = {"file": str(file), "about": printable(file.name)}
    if comparison.reference == "CYCLES" and any(settings.max_bounces >= 0 for settings in compared.values()):
        raise InputError("Cycles takes the scene's own path lengths: set Max Bounces of all methods to -1")
    probe = list(comparison.probe) if comparison.use_probe and min(comparison.probe) >= 0 else None
    file = Path(bpy.data.filepath).name or "an unsaved file"
    return {
        "methods": {name: to_dict(settings) for name, settings in compared.items()},
        "seeds": list(range(first, first + comparison.seeds)),
        "reference": reference,
        "out": str(folder),
        "command": printable(f"Blender {bpy.app.version_string}, Compare: scene '{scene.name}' of {file}"),
        "probe": probe,
        "machine": machine(scene.render),
    }


def scene_of(uid: int) -> bpy.types.Scene:
    """The scene of that number, whatever undo has done to it since. InputError if it is gone."""
    for scene in bpy.data.scenes:
        if scene.session_uid == uid:
            return scene
    raise InputError("the scene that was compared is gone; its results are in their folder")


class Background(bpy.types.Operator):
    """Starts long work and returns, or where there is no window does all of it; itself never registered."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if running.STATE.work:
            cls.poll_message_set(f"{running.STATE.work.label} is under way")
            return False
        if bpy.app.is_job_running("RENDER"):
            cls.poll_message_set("Blender is rendering, and can read the scene afterwards")
            return False
        return True

    def work(self, context: bpy.types.Context, patience: float) -> tuple[str, running.Steps, running.Finish]:
        """Label, steps and finish of the work. InputError where it cannot begin."""
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
        job, comparison, uid = job_of(scene, folder_of(scene)), scene.rl_guiding_comparison, scene.session_uid
        data = captured(scene)
        cycles = Cycles(scene, comparison.reference_spp) if comparison.reference == "CYCLES" else None
        steps = working(python, data, "compare", job, patience, cycles)

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
        scene, comparison = context.scene, context.scene.rl_guiding_comparison
        compared = methods.all_of(comparison)
        name = comparison.methods[max(0, min(comparison.active_method, len(compared) - 1))].name
        out = folder_of(scene) / "learnt" / name
        probe = list(comparison.probe) if min(comparison.probe) >= 0 else None
        values = {"settings": to_dict(compared[name]), "pixel": probe, "out": str(out), "machine": machine(scene.render)}
        steps = working(environment.python(), captured(scene), "inspect", values, patience)

        def finish(outcome: dict[str, Any]) -> str:
            shown = [results.opened(path, f"{name} {Path(path).stem}", _image(f"{name} {Path(path).stem}")) for path in outcome["pictures"]]
            for image in shown:
                image.use_fake_user = True  # it stays in the file although nothing in it refers to it
            show(shown[-1])
            undo_push("Show Q")
            return f"See the images '{shown[-1].name}' and '{shown[0].name}'"

        return f"Q of {name}", steps, finish


def _image(name: str) -> bpy.types.Image | None:
    return bpy.data.images.get(name)


def show(image: bpy.types.Image) -> bool:
    """Show an image in the largest image editor that there is; False where there is none."""
    areas = [area for window in bpy.context.window_manager.windows for area in window.screen.areas if area.type == "IMAGE_EDITOR"]
    if not areas:
        return False
    max(areas, key=lambda area: area.width * area.height).spaces.active.image = image
    return True


def undo_push(message: str) -> None:
    """A step that undo goes back to; results must not vanish with the user's next Ctrl+Z."""
    if windows := bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=windows[0]):
            bpy.ops.ed.undo_push(message=message)


class RLG_OT_cancel(bpy.types.Operator):
    """End what is under way. Finished runs are kept: the next comparison goes on from there."""

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
