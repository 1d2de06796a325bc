"""What of the scene cannot be rendered as it is, as a list: the object, where, and what stands in.

Each render fills it by `tell`, and "Check Scene" without one. It belongs to the window manager, because it is about a moment: so it
is neither saved in the file, nor a change of the file, nor taken back by undo.
"""

import queue
from collections.abc import Sequence

import bpy

from blender_rl_guiding.scene.description import Loss

from .reveal import reveal


class RLG_Loss(bpy.types.PropertyGroup):
    """A `Loss`, as Blender's lists can show it."""

    object: bpy.props.StringProperty()
    where: bpy.props.StringProperty()
    detail: bpy.props.StringProperty()

    @property
    def loss(self) -> Loss:
        """The same as plain data."""
        return Loss(self.object, self.where, self.detail)


def _on_click(coverage: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    bpy.ops.rl_guided.show_loss("EXEC_DEFAULT", True)  # True: a step of its own in the undo history


class RLG_Coverage(bpy.types.PropertyGroup):
    """The list, and what it is about."""

    scene: bpy.props.StringProperty(description="Name of the scene that was looked at; empty before the first time")
    fault: bpy.props.StringProperty(description="What makes the scene impossible to render; empty if nothing does")
    losses: bpy.props.CollectionProperty(type=RLG_Loss)
    active: bpy.props.IntProperty(name="Loss", description="Click to select what it is about", default=-1, min=-1, update=_on_click)


_LOOK = 0.25  # seconds between two looks at what other threads have told
_told: queue.SimpleQueue[tuple[str, Sequence[Loss], str]] = queue.SimpleQueue()


def tell(scene: str, losses: Sequence[Loss], fault: str = "") -> None:
    """Show what the export of a scene, by its name, found. From any thread: where Blender has a window, engines render in one."""
    if bpy.app.background:
        show(scene, losses, fault)
    else:
        _told.put((scene, losses, fault))  # only the main thread may change Blender's data, or register a timer


def _show_told() -> float:
    """What the main thread does every now and then."""
    while not _told.empty():
        show(*_told.get())
    return _LOOK


def show(scene: str, losses: Sequence[Loss], fault: str = "") -> None:
    """As `tell`, at once, from the main thread."""
    manager = bpy.data.window_managers[0]
    coverage = manager.rl_guiding_coverage
    coverage.property_unset("active")  # without the update that a click causes
    coverage.scene, coverage.fault = scene, fault
    coverage.losses.clear()
    for loss in losses:
        line = coverage.losses.add()
        line.object, line.where, line.detail = loss.object, loss.where, loss.detail
    for area in (area for window in manager.windows for area in window.screen.areas if area.type == "PROPERTIES"):
        area.tag_redraw()


@bpy.app.handlers.persistent
def _forget(_: object) -> None:
    """Another file is open: what is listed is not about it."""
    show("", ())


class RLG_OT_show_loss(bpy.types.Operator):
    """See `reveal`."""

    bl_idname = "rl_guided.show_loss"
    bl_label = "Show in Scene"
    bl_description = "Select what the chosen line of the list is about"
    bl_options = {"UNDO", "INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        coverage = context.window_manager.rl_guiding_coverage
        if not 0 <= coverage.active < len(coverage.losses):
            return {"CANCELLED"}
        if missing := reveal(coverage.losses[coverage.active].loss, context):
            self.report({"INFO"}, missing)
        return {"FINISHED"}


_CLASSES = (RLG_Loss, RLG_Coverage, RLG_OT_show_loss)


def register() -> None:
    """The list as `window_manager.rl_guiding_coverage`."""
    for one in _CLASSES:
        bpy.utils.register_class(one)
    bpy.types.WindowManager.rl_guiding_coverage = bpy.props.PointerProperty(type=RLG_Coverage, name="Coverage")
    bpy.app.handlers.load_post.append(_forget)
    if not bpy.app.background:
        bpy.app.timers.register(_show_told, persistent=True)


def unregister() -> None:
    """Undo `register`."""
    if bpy.app.timers.is_registered(_show_told):
        bpy.app.timers.unregister(_show_told)
    bpy.app.handlers.load_post.remove(_forget)
    del bpy.types.WindowManager.rl_guiding_coverage
    for one in reversed(_CLASSES):
        bpy.utils.unregister_class(one)
