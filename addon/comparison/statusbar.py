"""Progress in the status bar, as Blender shows its own jobs: a bar, and a button that cancels."""

import bpy

from .running import STATE


def draw(self: bpy.types.Header, context: bpy.types.Context) -> None:
    """Added to the status bar's own."""
    if STATE.work is None:
        return
    row = self.layout.row(align=True)
    row.ui_units_x = 16
    row.progress(text=f"{STATE.work.label}: {STATE.work.status.text}", factor=STATE.work.status.share)
    row.operator("rl_guided.cancel", text="", icon="X")


def register() -> None:
    """Join the status bar."""
    bpy.types.STATUSBAR_HT_header.append(draw)


def unregister() -> None:
    """Undo `register`."""
    bpy.types.STATUSBAR_HT_header.remove(draw)
