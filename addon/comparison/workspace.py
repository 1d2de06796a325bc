"""The workspace "Compare": image editors side by side, the reference first, in place of the largest editor of the present one."""

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import bpy

NAME = "Compare"
_MOST = 12  # editors side by side: smaller ones show nothing
_LOOK = 0.05  # seconds; Blender changes workspaces between events


def show(window: bpy.types.Window, images: Sequence[bpy.types.Image]) -> None:
    """Go to the workspace, which is made if it is not there, and show the images in it.

    Deleting the workspace removes all of this again.
    """
    if there := bpy.data.workspaces.get(NAME):
        window.workspace = there
    else:
        before = {workspace.name for workspace in bpy.data.workspaces}
        with bpy.context.temp_override(window=window):
            bpy.ops.workspace.duplicate()
        there = next(workspace for workspace in bpy.data.workspaces if workspace.name not in before)
        there.name = NAME
    bpy.app.timers.register(partial(_fill, window, [image.name for image in images[:_MOST]]), first_interval=_LOOK)


def _fill(window: bpy.types.Window, names: Sequence[str]) -> float | None:
    """Once the workspace is there, show images in it."""
    if window.workspace.name != NAME:
        return _LOOK
    images = [bpy.data.images[name] for name in names if name in bpy.data.images]
    areas = _editors(window.screen)
    if len(areas) != len(images):
        areas = _split(window, _cleared(window, areas), len(images))
    for area, image in zip(areas, images, strict=True):
        space: Any = area.spaces.active
        space.image, space.show_region_header, space.show_region_toolbar, space.show_region_ui = image, True, False, False
        space.overlay.show_overlays = True
        with bpy.context.temp_override(window=window, area=area, region=next(r for r in area.regions if r.type == "WINDOW")):
            bpy.ops.image.view_all(fit_view=True)
    return None


def _editors(screen: bpy.types.Screen) -> list[bpy.types.Area]:
    """The image editors in the order of reading."""
    return sorted((area for area in screen.areas if area.type == "IMAGE_EDITOR"), key=lambda area: (-area.y, area.x))


def _cleared(window: bpy.types.Window, editors: Sequence[bpy.types.Area]) -> bpy.types.Area:
    """One image editor in place of several, or of the largest area if there is none."""
    if not editors:
        largest = max(window.screen.areas, key=lambda area: area.width * area.height)
        largest.type = "IMAGE_EDITOR"
        return largest
    for area in editors[1:]:
        with bpy.context.temp_override(window=window, area=area):
            bpy.ops.screen.area_close()
    return _editors(window.screen)[0]


def _split(window: bpy.types.Window, area: bpy.types.Area, count: int) -> list[bpy.types.Area]:
    """A grid of `count` areas, in rows that are about as wide as they are long, in the order of reading."""
    rows = max(1, round(math.sqrt(count * area.height / area.width)))
    rest, strips = count, _cut(window, area, "HORIZONTAL", rows)
    for k, strip in enumerate(sorted(strips, key=lambda strip: -strip.y)):
        here = math.ceil(rest / (rows - k))
        _cut(window, strip, "VERTICAL", here)
        rest -= here
    return _editors(window.screen)


def _cut(window: bpy.types.Window, area: bpy.types.Area, direction: str, parts: int) -> list[bpy.types.Area]:
    """An area cut into equal parts."""
    found = [area]
    for left in range(parts, 1, -1):
        before = {a.as_pointer() for a in window.screen.areas}
        with bpy.context.temp_override(window=window, area=found[-1]):
            bpy.ops.screen.area_split(direction=direction, factor=1 / left)
        new = next(a for a in window.screen.areas if a.as_pointer() not in before)
        old = found.pop()
        found += sorted((old, new), key=lambda a: a.width if direction == "VERTICAL" else a.height)  # the larger is cut on
    return found
