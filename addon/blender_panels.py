"""Blender's own panels under this engine: those that say what it renders are shown, those of what it does not honour are not."""

from collections.abc import Iterator

import bpy

from .engine import RLGuided

_STANDARD = "BLENDER_RENDER"  # panels that are meant for every engine name it
_LEFT_OUT = {
    # The renderer has nothing to show a preview by.
    "DATA_PT_preview",
    # Others stand in: that of EEVEE, whose light is described as here, and those of cycles_panels.py.
    "DATA_PT_light",
    "NODE_DATA_PT_light",
    "RENDER_PT_simplify",
    "RENDER_PT_simplify_render",
    "RENDER_PT_simplify_viewport",
    # What is not rendered, and is in the coverage report.
    "DATA_PT_camera_stereoscopy",
    "EEVEE_MATERIAL_PT_viewport_settings",
    "RENDER_PT_freestyle",
    "RENDER_PT_gpencil",
    "RENDER_PT_grease_pencil_render",
    "RENDER_PT_grease_pencil_viewport",
    "RENDER_PT_simplify_greasepencil",
    "RENDER_PT_stereoscopy",
    "MATERIAL_PT_freestyle_line",
}
_LEFT_OUT_PREFIXES = ("VIEWLAYER_PT_freestyle", "DATA_PT_lightprobe")
_TAKEN = {
    "DATA_PT_EEVEE_light",
    "DATA_PT_camera_dof",
    "DATA_PT_camera_dof_aperture",
    "EEVEE_MATERIAL_PT_context_material",
}


def wanted() -> Iterator[type]:
    """The registered panels of Blender that are shown under this engine."""
    for panel in bpy.types.Panel.__subclasses__():
        name, engines = panel.__name__, getattr(panel, "COMPAT_ENGINES", ())
        left_out = name in _LEFT_OUT or name.startswith(_LEFT_OUT_PREFIXES)
        if name in _TAKEN or (_STANDARD in engines and not left_out):
            yield panel


def register() -> None:
    """Show them."""
    for panel in wanted():
        panel.COMPAT_ENGINES.add(RLGuided.bl_idname)


def unregister() -> None:
    """Undo `register`."""
    for panel in bpy.types.Panel.__subclasses__():
        if RLGuided.bl_idname in (engines := getattr(panel, "COMPAT_ENGINES", set())):
            engines.discard(RLGuided.bl_idname)
