"""The panels of a comparison, in Render properties."""

from typing import Any

import bpy

from blender_rl_guiding.settings import Render

from .. import panels
from ..panel import EnginePanel
from ..text import draw_text
from . import results, running
from .show_operators import KINDS

_NOT_OF_A_METHOD = {"spp", "seconds", "passes", "denoise"}  # set by the comparison for all methods, or without meaning in it


class _Panel(EnginePanel):
    bl_options = {"DEFAULT_CLOSED"}


class RLG_PT_compare(_Panel, bpy.types.Panel):
    """The methods, their budget, the reference, and the button that starts the comparison."""

    bl_idname = "RLG_PT_compare"
    bl_label = "Compare Methods"

    def draw(self, context: bpy.types.Context) -> None:
        layout, comparison = self.layout, context.scene.rl_guiding_comparison
        _draw_list(layout, comparison)
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.row().prop(comparison, "budget", expand=True)
        layout.prop(comparison, "spp" if comparison.budget == "SAMPLES" else "seconds")
        layout.prop(comparison, "seeds")
        _draw_reference(layout, comparison, context)
        layout.prop(comparison, "folder")
        _draw_state(layout, context)


def _draw_list(layout: bpy.types.UILayout, comparison: bpy.types.PropertyGroup) -> None:
    row = layout.row()
    row.template_list("RLG_UL_methods", "", comparison, "methods", comparison, "active_method", rows=5)
    side = row.column(align=True)
    side.menu("RLG_MT_method_add", text="", icon="ADD")
    side.operator("rl_guided.method_remove", text="", icon="REMOVE")
    side.separator()
    side.menu("RLG_MT_method_specials", text="", icon="DOWNARROW_HLT")
    side.separator()
    side.operator("rl_guided.method_move", text="", icon="TRIA_UP").step = -1
    side.operator("rl_guided.method_move", text="", icon="TRIA_DOWN").step = 1


def _draw_reference(layout: bpy.types.UILayout, comparison: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    column = layout.column()
    column.prop(comparison, "reference")
    column.prop(comparison, "reference_file" if comparison.reference == "FILE" else "reference_spp")
    if comparison.reference == "CYCLES":
        about = comparison.bl_rna.properties["reference"].enum_items["CYCLES"].description
        draw_text(column.column(align=True), about, context, "INFO")


def _draw_state(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """The progress of the running work. If no work is running, the button, and below it the final line of the last work."""
    state = running.STATE
    if state.work:
        row = layout.row(align=True)
        row.progress(text=state.work.line, factor=state.work.status.share)
        row.operator("rl_guided.cancel", text="", icon="X")
        if state.work.note:
            draw_text(layout.column(align=True), state.work.note, context, "INFO")
        return
    row = layout.row()
    row.scale_y = 1.4
    row.operator("rl_guided.compare", icon="RENDER_RESULT")
    if state.last_words:
        draw_text(layout.column(align=True), state.last_words, context, "ERROR" if state.failed else "CHECKMARK")


class RLG_PT_compare_method(_Panel, bpy.types.Panel):
    """The settings of the active method."""

    bl_idname = "RLG_PT_compare_method"
    bl_parent_id = "RLG_PT_compare"
    bl_label = "Settings of the Method"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return bool(context.scene.rl_guiding_comparison.methods)

    def draw(self, context: bpy.types.Context) -> None:
        comparison = context.scene.rl_guiding_comparison
        if comparison.active_method < len(comparison.methods):
            self.layout.use_property_split, self.layout.use_property_decorate = True, False
            _draw_settings(self.layout, comparison.methods[comparison.active_method].settings)


def _draw_settings(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    """The panels of a render with these settings; each has a header that opens and closes it."""
    for section in panels.sections(Render):
        group = panels.group_at(settings, section.path)
        shown = [entry for entry in section.entries if entry.name not in _NOT_OF_A_METHOD]
        if group is None or not shown:
            continue
        header, body = layout.panel(f"RLG_compared_{section.name}", default_closed=section.title in panels.CLOSED)
        header.label(text=section.title)
        if body:
            panels.draw(body, group, shown)


class RLG_PT_compare_results(_Panel, bpy.types.Panel):
    """The table, and buttons for images, slots and the report."""

    bl_idname = "RLG_PT_compare_results"
    bl_parent_id = "RLG_PT_compare"
    bl_label = "Results"
    bl_options = set()

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return bool(context.scene.rl_guiding_comparison.results)

    def draw(self, context: bpy.types.Context) -> None:
        layout, comparison = self.layout, context.scene.rl_guiding_comparison
        row = layout.row()
        row.label(text="Error")
        row.prop(comparison, "measure", text="")
        column = layout.column(align=True)
        _draw_row(column, *results.HEADS, header=True)
        column.template_list("RLG_UL_results", "", comparison, "results", comparison, "active_result", rows=3)
        if comparison.active_result < len(comparison.results):
            _draw_details(layout, comparison.results[comparison.active_result])
        draw_text(layout.column(align=True), f"Reference: {comparison.about}", context, "IMAGE_REFERENCE")
        _draw_ways(layout, comparison)
        layout.operator("rl_guided.to_slots", icon="RENDERLAYERS")
        layout.operator("rl_guided.open_report", icon="URL")
        layout.operator("rl_guided.clear_results", icon="TRASH")


def _draw_details(layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
    """More numbers of the active row."""
    column = layout.column(align=True)
    column.active = False
    row = column.row(align=True)
    row.label(text=f"{item.spp} samples")
    row.label(text=f"{item.samples_per_second:.3g} a second")
    column.label(text=f"{item.learn_share:.0%} of the time is learning")
    column.label(text=f"×{item.equal_time:.3g} relmse at equal time")


def _draw_ways(layout: bpy.types.UILayout, comparison: bpy.types.PropertyGroup) -> None:
    row = layout.row(align=True)
    for kind, label, _, _ in KINDS:
        if kind != "PICTURES" or comparison.pictures:
            row.operator("rl_guided.side_by_side", text=label, icon="IMAGE_REFERENCE" if kind == "IMAGES" else "NONE").kind = kind


def _draw_row(layout: bpy.types.UILayout, name: str, *cells: str, header: bool = False) -> None:
    """A row of the table; the name has the widest column."""
    split = layout.split(factor=0.37)
    split.label(text=name)
    numbers = split.split()  # columns of equal widths
    numbers.active = not header
    for cell in cells:
        part = numbers.row()
        part.alignment = "RIGHT"
        part.label(text=cell)


class RLG_UL_results(bpy.types.UIList):
    """A row for each method; the first is the baseline."""

    def draw_item(self, context: Any, layout: Any, data: Any, item: Any, icon: Any, active: Any, prop: str, index: int) -> None:
        row = results.row_of(data, item)
        _draw_row(layout, row.name, *(cell.text for cell in row.cells))


class RLG_PT_compare_probe(_Panel, bpy.types.Panel):
    """The pixel at which the report shows Q of the methods."""

    bl_idname = "RLG_PT_compare_probe"
    bl_parent_id = "RLG_PT_compare"
    bl_label = "What Is Learnt"

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.rl_guiding_comparison, "use_probe", text="")

    def draw(self, context: bpy.types.Context) -> None:
        layout, comparison = self.layout, context.scene.rl_guiding_comparison
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.active = comparison.use_probe
        layout.prop(comparison, "probe")
        row = layout.row(align=True)
        row.operator("rl_guided.pick", icon="EYEDROPPER")
        row.operator("rl_guided.pick_cursor", icon="CURSOR")
        layout.operator("rl_guided.inspect", text="Show Q of the Method", icon="LIGHT_HEMI")


_CLASSES = (RLG_UL_results, RLG_PT_compare, RLG_PT_compare_results, RLG_PT_compare_probe, RLG_PT_compare_method)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
