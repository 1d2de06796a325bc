"""The workspace "Compare": image editors side by side, the reference first, in place of the largest editor of the current workspace."""

from collections.abc import Sequence
from functools import partial
from itertools import combinations

import bpy

from ..areas import largest

NAME = "Compare"
_MOST = 12  # maximal number of editors side by side; with more, each would be too small
_APART = 8  # maximal gap in pixels between neighbouring areas
_LOOK = 0.05  # seconds; Blender changes workspaces between events


def show(window: bpy.types.Window, images: Sequence[bpy.types.Image]) -> None:
    """Go to the workspace and show the images in it. The workspace is created if it does not exist.

    To undo all this, delete the workspace.
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
    """Do one step towards a workspace with one editor for each image. The last step shows the images.

    There are several steps, because a new area has no size until Blender draws it. Returns the seconds until the next step; None at the
    end.
    """
    if window.workspace.name != NAME:
        return _LOOK
    images = [bpy.data.images[name] for name in names if name in bpy.data.images]
    editors = _editors(window.screen)
    if not editors:
        largest(window.screen.areas).type = "IMAGE_EDITOR"
        return _LOOK
    if len(editors) > len(images) and _join(window, editors):
        return _LOOK
    if len(editors) < len(images) and _halve(window, largest(editors)):
        return _LOOK
    for area, image in zip(editors, images, strict=False):
        _show_in(window, area, image)
    return None


def _editors(screen: bpy.types.Screen) -> list[bpy.types.Area]:
    """The image editors in the order of reading."""
    return sorted((area for area in screen.areas if area.type == "IMAGE_EDITOR"), key=lambda area: (-area.y, area.x))


def _halve(window: bpy.types.Window, area: bpy.types.Area) -> bool:
    """Cut an area across its longer side; False if it is too small."""
    direction = "VERTICAL" if area.width >= area.height else "HORIZONTAL"
    with bpy.context.temp_override(window=window, area=area):
        return "FINISHED" in bpy.ops.screen.area_split(direction=direction, factor=0.5)


def _join(window: bpy.types.Window, editors: Sequence[bpy.types.Area]) -> bool:
    """Join two editors that have a whole side in common, so that no other kind of editor grows; False if there are none."""
    for one, other in combinations(reversed(editors), 2):
        if _share_a_side(one, other):
            source, target = ((area.x + area.width // 2, area.y + area.height // 2) for area in (other, one))
            with bpy.context.temp_override(window=window, area=other):
                return "FINISHED" in bpy.ops.screen.area_join(source_xy=source, target_xy=target)
    return False


def _share_a_side(one: bpy.types.Area, other: bpy.types.Area) -> bool:
    """Two areas that stand below or beside each other, and are equally wide or high. Areas are a pixel or two apart."""
    beside = abs(one.y - other.y) < _APART and abs(one.height - other.height) < _APART
    below = abs(one.x - other.x) < _APART and abs(one.width - other.width) < _APART
    touch_x = min(abs(one.x + one.width - other.x), abs(other.x + other.width - one.x)) < _APART
    touch_y = min(abs(one.y + one.height - other.y), abs(other.y + other.height - one.y)) < _APART
    return (beside and touch_x) or (below and touch_y)


def _show_in(window: bpy.types.Window, area: bpy.types.Area, image: bpy.types.Image) -> None:
    """Show all of an image in an editor."""
    area.spaces.active.image = image
    with bpy.context.temp_override(window=window, area=area, region=next(r for r in area.regions if r.type == "WINDOW")):
        bpy.ops.image.view_all(fit_view=True)
