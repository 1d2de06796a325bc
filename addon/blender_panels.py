"""Shows Blender's own panels under this engine, except panels of settings that the engine ignores."""

from collections.abc import Iterator

import bpy

from .panel import ENGINE

_STANDARD = "BLENDER_RENDER"  # Blender's panels for all engines list this name
_LEFT_OUT = {
    # There are no previews.
    "DATA_PT_preview",
    # Replaced by other panels: EEVEE's panel of lights, which has the same properties, and cycles_panels.py.
    "DATA_PT_light",
    "NODE_DATA_PT_light",
    "RENDER_PT_simplify",
    "RENDER_PT_simplify_render",
    "RENDER_PT_simplify_viewport",
    # Not rendered; the coverage report lists it.
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
    """Blender's registered panels to show."""
    for panel in bpy.types.Panel.__subclasses__():
        name, engines = panel.__name__, getattr(panel, "COMPAT_ENGINES", ())
        left_out = name in _LEFT_OUT or name.startswith(_LEFT_OUT_PREFIXES)
        if name in _TAKEN or (_STANDARD in engines and not left_out):
            yield panel


def register() -> None:
    """Show them."""
    for panel in wanted():
        panel.COMPAT_ENGINES.add(ENGINE)


def unregister() -> None:
    """Undo `register`."""
    for panel in bpy.types.Panel.__subclasses__():
        getattr(panel, "COMPAT_ENGINES", set()).discard(ENGINE)
