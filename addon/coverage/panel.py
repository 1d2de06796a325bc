"""The panel of the coverage report, in Render properties."""

import bpy

from ..panel import EnginePanel
from ..text import draw_text
from .check import RLG_OT_check

_ROWS = 3


class RLG_UL_losses(bpy.types.UIList):
    """A line for each loss: the object, the place in the object, and the substitute."""

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index=0) -> None:
        split = layout.split(factor=0.3)
        split.label(text=item.object, translate=False, icon=_icon(item.object))
        split.label(text=": ".join(filter(None, (item.where, item.detail))), translate=False)

    def filter_items(self, context, data, property) -> tuple[list[int], list[int]]:
        """Filter: show the lines that contain the typed text."""
        wanted = self.filter_name.lower()
        lines = [f"{loss.object} {loss.where} {loss.detail}".lower() for loss in getattr(data, property)]
        return [self.bitflag_filter_item if wanted in line else 0 for line in lines], []


def _icon(name: str) -> str:
    thing = bpy.data.objects.get(name)
    if thing is None:
        return "WORLD" if name in bpy.data.worlds else "SCENE_DATA"
    return f"OUTLINER_OB_{thing.type}" if f"OUTLINER_OB_{thing.type}" in _ICONS else "OBJECT_DATA"


_ICONS = bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items.keys()


class RLG_PT_coverage(EnginePanel, bpy.types.Panel):
    """The list of losses, and Check Scene."""

    bl_label = "Coverage"

    def draw(self, context: bpy.types.Context) -> None:
        layout, coverage = self.layout, context.window_manager.rl_guiding_coverage
        if coverage.losses:
            layout.template_list("RLG_UL_losses", "", coverage, "losses", coverage, "active", rows=_ROWS)
            _draw_loss(layout, coverage, context)
        layout.operator(RLG_OT_check.bl_idname, icon="VIEWZOOM")
        draw_text(layout.column(align=True), summary(coverage), context)


def _draw_loss(layout: bpy.types.UILayout, coverage: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """The chosen line in full: the list is too narrow for it."""
    if not 0 <= coverage.active < len(coverage.losses):
        return
    loss = coverage.losses[coverage.active]
    column = layout.box().column(align=True)
    for text in filter(None, (loss.object, loss.where, loss.detail)):
        draw_text(column, text, context)


def summary(coverage: bpy.types.PropertyGroup) -> str:
    """A one-line summary of the list."""
    if not coverage.scene:
        return "Not checked yet"
    if coverage.fault:
        return coverage.fault
    if not coverage.losses:
        return f"{coverage.scene}: all is taken over"
    count = len(coverage.losses)
    return f"{coverage.scene}: {count} {'thing' if count == 1 else 'things'} replaced or left out"


_CLASSES = (RLG_UL_losses, RLG_PT_coverage)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
