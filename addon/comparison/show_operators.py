"""Looking at results: images, slots, a workspace, the report."""

# pyright: reportInvalidTypeForm=false

import os
from pathlib import Path

import bpy

from blender_rl_guiding.errors import InputError

from ..acting import Acting
from . import results, slots, workspace
from .operators import all_folders_of, show


def images_of(comparison: bpy.types.PropertyGroup, kind: str = "IMAGES") -> dict[str, bpy.types.Image]:
    """Images by name: the reference and each method's image, or their error maps, or the report's pictures."""
    if kind == "ERRORS":
        found = {f"{item.name} error": item.heat for item in comparison.results}
    elif kind == "PICTURES":
        found = {item.name: item.image for item in comparison.pictures}
    else:
        found = {"reference": comparison.reference_image} | {item.name: item.image for item in comparison.results}
    return {name: image for name, image in found.items() if image}


KINDS = [
    ("IMAGES", "Images", "The reference and each method's image", 0),
    ("ERRORS", "Errors", "The error map of each method", 1),
    ("PICTURES", "Curves", "Error curves, losses, and Q at the probed point", 2),
]


class _Look(Acting):
    """Shows results. Only subclasses are registered."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return bool(context.scene.rl_guiding_comparison.results)


class RLG_OT_show_image(_Look):
    """Show this image in the largest image editor."""

    bl_idname = "rl_guided.show_image"
    bl_label = "Show Image"
    bl_options = {"INTERNAL"}

    name: bpy.props.StringProperty()

    def act(self, context: bpy.types.Context) -> None:
        if self.name not in bpy.data.images:
            raise InputError(f"the image '{self.name}' is gone")
        if not show(bpy.data.images[self.name]):
            raise InputError("there is no image editor: Side by Side makes some")


class RLG_OT_to_slots(_Look):
    """Put the reference and all methods' images into slots of the Render Result: J flips between them."""

    bl_idname = "rl_guided.to_slots"
    bl_label = "Put into Render Slots"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and not bpy.app.is_job_running("RENDER")

    def act(self, context: bpy.types.Context) -> None:
        slots.put(context.scene, images_of(context.scene.rl_guiding_comparison))
        show(slots.result())


class RLG_OT_side_by_side(_Look):
    """Show images side by side in a workspace of their own, Compare. Deleting that workspace undoes it."""

    bl_idname = "rl_guided.side_by_side"
    bl_label = "Side by Side"

    kind: bpy.props.EnumProperty(items=KINDS, name="Show")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.window is not None

    def act(self, context: bpy.types.Context) -> None:
        workspace.show(context.window, list(images_of(context.scene.rl_guiding_comparison, self.kind).values()))


def _browse(page: Path) -> None:
    bpy.ops.wm.url_open(url=page.as_uri())


class RLG_OT_open_report(_Look):
    """Open the report in the browser: tables with error bars, curves, error maps, a viewer that flips between images."""

    bl_idname = "rl_guided.open_report"
    bl_label = "Open Report"

    def act(self, context: bpy.types.Context) -> None:
        comparison = context.scene.rl_guiding_comparison
        page = Path(bpy.path.abspath(comparison.page))
        inside = Path(os.path.realpath(page)).is_relative_to(os.path.realpath(all_folders_of(comparison)))
        if page.name != "report.html" or not inside:  # a stranger's .blend may name any file here, even a program
            raise InputError(f"{page} is no report in the folder of the comparison: compare again to make one")
        if not page.is_file():
            raise InputError(f"the report is not at {page} any more: compare again to make it")
        _browse(page)


class RLG_OT_clear_results(_Look):
    """Remove the table and its images from this file. Runs and report stay in their folder."""

    bl_idname = "rl_guided.clear_results"
    bl_label = "Clear Results"
    bl_options = {"UNDO"}

    def act(self, context: bpy.types.Context) -> None:
        results.clear(context.scene.rl_guiding_comparison)


_CLASSES = (RLG_OT_show_image, RLG_OT_to_slots, RLG_OT_side_by_side, RLG_OT_open_report, RLG_OT_clear_results)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
