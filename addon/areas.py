"""Finds and redraws the areas of all windows."""

from collections.abc import Iterable, Iterator

import bpy


def areas(*types: str) -> Iterator[bpy.types.Area]:
    """All areas of these types."""
    for window in bpy.data.window_managers[0].windows:
        yield from (area for area in window.screen.areas if area.type in types)


def redraw(*types: str) -> None:
    """Redraw the areas of these types."""
    for area in areas(*types):
        area.tag_redraw()


def largest(among: Iterable[bpy.types.Area]) -> bpy.types.Area:
    """The largest of some areas."""
    return max(among, key=lambda area: area.width * area.height)
