"""The render engine RL Guided: what Blender calls on F12, and the only place that sees a depsgraph in render mode."""

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import SceneData

from .export.scene import export


class Exporter(bpy.types.RenderEngine):
    """What every engine of the add-on does, itself never registered: export the scene and hand it to `deliver`."""

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        try:
            self.deliver(export(depsgraph))
        except InputError as error:
            self.report({"ERROR"}, str(error))  # unlike error_set, this fails the operator, too

    def deliver(self, scene: SceneData) -> None:
        """Do with the scene what the engine is for. InputError ends the render, and Blender shows its line."""
        raise NotImplementedError


class RLGuided(Exporter):
    """The engine of the user's menu; rendering inside Blender is still to come."""

    bl_idname = "RL_GUIDED"
    bl_label = "RL Guided"
    bl_use_shading_nodes_custom = False  # materials are made of the nodes of Cycles

    def deliver(self, scene: SceneData) -> None:
        raise InputError(
            f"'{scene.name}' can be rendered, but not inside Blender yet: save it and run `rlg render FILE.blend --out FOLDER`"
        )


def register() -> None:
    """The engine."""
    bpy.utils.register_class(RLGuided)


def unregister() -> None:
    """Undo `register`."""
    bpy.utils.unregister_class(RLGuided)
