"""The base of the add-on's panels in Properties: they are visible only under its engine."""

import bpy

ENGINE = "RL_GUIDED"  # the engine's name in files


class EnginePanel:
    """A panel in Render properties, unless it says otherwise."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    layout: bpy.types.UILayout

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine == ENGINE
