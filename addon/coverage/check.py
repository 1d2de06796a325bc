"""The operator Check Scene: fills the list of losses without a render."""

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.chance import left_to_chance
from blender_rl_guiding.scene.description import Loss

from ..capture import captured
from ..export.coverage import in_blender
from .losses import show


def check(scene: bpy.types.Scene) -> tuple[tuple[Loss, ...], str]:
    """The losses of a scene, and the reason why it cannot be rendered. The reason is empty if the scene can be rendered."""
    try:
        found = captured(scene)
        return (*in_blender(found.coverage), *left_to_chance(found, scene.rl_guiding.nee)), ""
    except InputError as error:
        return (), str(error)


class RLG_OT_check(bpy.types.Operator):
    """Fills the list for the present scene."""

    bl_idname = "rl_guided.check"
    bl_label = "Check Scene"
    bl_description = (
        "List the parts of this scene that cannot be rendered exactly. A large scene takes a while, because it is read as for a render"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return not bpy.app.is_job_running("RENDER")

    def execute(self, context: bpy.types.Context) -> set[str]:
        losses, fault = check(context.scene)
        show(context.scene.name, losses, fault)
        if fault:
            self.report({"WARNING"}, fault)
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((RLG_OT_check,))
