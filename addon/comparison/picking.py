"""Chooses the pixel at which Q is shown: with a click into an image or the scene, or with the 3D cursor."""

import bpy
from bpy_extras.object_utils import world_to_camera_view
from bpy_extras.view3d_utils import region_2d_to_origin_3d, region_2d_to_vector_3d
from mathutils import Vector

from blender_rl_guiding.errors import InputError

from ..acting import Acting
from ..export.camera import region_of


def size_of(scene: bpy.types.Scene) -> tuple[int, int]:
    """Width and height of the image that the scene renders."""
    left, right, bottom, top = region_of(scene.render)
    return max(1, right - left), max(1, top - bottom)


def pixel_at(scene: bpy.types.Scene, point: Vector) -> tuple[int, int]:
    """The pixel at which a point of the world is visible. InputError if the camera does not see the point."""
    if scene.camera is None:
        raise InputError(f"scene '{scene.name}' has no camera")
    right, up, depth = world_to_camera_view(scene, scene.camera, point)
    if depth <= 0:
        raise InputError("that point is behind the camera")
    render = scene.render
    if render.use_border:
        right = (right - render.border_min_x) / (render.border_max_x - render.border_min_x)
        up = (up - render.border_min_y) / (render.border_max_y - render.border_min_y)
    return pixel_of(right, up, size_of(scene))


def pixel_of(right: float, up: float, size: tuple[int, int]) -> tuple[int, int]:
    """Column and row, from the top left, of a place in the image; 0, 0 is the lower left and 1, 1 the upper right corner.

    InputError outside of it.
    """
    if not (0 <= right < 1 and 0 < up <= 1):
        raise InputError("that point is outside of the image")
    width, height = size
    return min(int(right * width), width - 1), min(int((1 - up) * height), height - 1)


def clicked(context: bpy.types.Context, x: int, y: int) -> tuple[int, int]:
    """The pixel under a place in the window. InputError if there is none."""
    for area in context.window.screen.areas:
        for region in area.regions:
            here = x - region.x, y - region.y
            if region.type == "WINDOW" and 0 <= here[0] < region.width and 0 <= here[1] < region.height:
                if area.type == "IMAGE_EDITOR":
                    right, up = region.view2d.region_to_view(*here)
                    return pixel_of(right, up, size_of(context.scene))
                if area.type == "VIEW_3D":
                    return pixel_at(context.scene, _surface(context, region, area.spaces.active.region_3d, here))
    raise InputError("click into an image editor or the 3D viewport")


def _surface(context: bpy.types.Context, region: bpy.types.Region, view: bpy.types.RegionView3D, here: tuple[int, int]) -> Vector:
    """The first surface below a place in the 3D viewport."""
    origin, direction = region_2d_to_origin_3d(region, view, here), region_2d_to_vector_3d(region, view, here)
    hit, location, *_ = context.scene.ray_cast(context.evaluated_depsgraph_get(), origin, direction)
    if not hit:
        raise InputError("there is no surface")
    return location


class RLG_OT_pick(bpy.types.Operator):
    """Click on a surface, in an image of the scene or in the 3D viewport, to see what is learnt there."""

    bl_idname = "rl_guided.pick"
    bl_label = "Pick a Point"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.window.cursor_modal_set("EYEDROPPER")
        context.workspace.status_text_set("Click on a surface, in an image or the 3D viewport; Esc or right click ends")
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type in {"ESC", "RIGHTMOUSE"}:
            return self._end(context, {"CANCELLED"})
        if event.type != "LEFTMOUSE" or event.value != "PRESS":
            return {"RUNNING_MODAL"} if event.type == "LEFTMOUSE" else {"PASS_THROUGH"}
        try:
            _take(context.scene, clicked(context, event.mouse_x, event.mouse_y))
        except InputError as error:
            self.report({"WARNING"}, str(error))
            return self._end(context, {"CANCELLED"})
        return self._end(context, {"FINISHED"})

    def _end(self, context: bpy.types.Context, outcome: set[str]) -> set[str]:
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)
        return outcome


class RLG_OT_pick_cursor(Acting):
    """Take the pixel that sees the 3D cursor."""

    bl_idname = "rl_guided.pick_cursor"
    bl_label = "From 3D Cursor"
    bl_options = {"UNDO"}

    def act(self, context: bpy.types.Context) -> None:
        _take(context.scene, pixel_at(context.scene, context.scene.cursor.location))


def _take(scene: bpy.types.Scene, pixel: tuple[int, int]) -> None:
    scene.rl_guiding_comparison.use_probe = True
    scene.rl_guiding_comparison.probe = pixel


_CLASSES = (RLG_OT_pick, RLG_OT_pick_cursor)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
