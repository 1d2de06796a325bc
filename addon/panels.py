"""The panel in Render properties: it walks the settings, so a new setting needs no code here."""

import bpy

from blender_rl_guiding.schema import Settings, entries
from blender_rl_guiding.settings import Render

from .engine import RLGuided


def draw(layout: bpy.types.UILayout, group: bpy.types.PropertyGroup, config: type[Settings]) -> None:
    """Draw every setting of a class, and below a menu the settings of the chosen variant alone."""
    for entry in entries(config):
        layout.prop(group, entry.name)
        if entry.variants:
            chosen = getattr(group, entry.name)
            draw(layout.column(align=True), getattr(group, f"{entry.name}_{chosen}"), entry.variants[chosen])


class RLG_PT_render(bpy.types.Panel):
    """The settings of a render, as in `blender_rl_guiding.settings.Render`."""

    bl_label = "RL Guided"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine == RLGuided.bl_idname

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False  # the settings cannot be animated
        draw(self.layout, context.scene.rl_guiding, Render)


def register() -> None:
    """The panel."""
    bpy.utils.register_class(RLG_PT_render)


def unregister() -> None:
    """Undo `register`."""
    bpy.utils.unregister_class(RLG_PT_render)
