"""Progress of long work in the status bar: a bar and a button that cancels, as for Blender's own jobs."""

import bpy

from .running import STATE


def draw(self: bpy.types.Header, context: bpy.types.Context) -> None:
    """Draw the progress of the running work to the right of Blender's own status bar."""
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
