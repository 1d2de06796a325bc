"""The list of losses. A loss has an object that is not rendered exactly, the place in the object, and the substitute.

Each render fills the list with `tell`, Check Scene with `show`. The list belongs to the window manager. So it is not saved in the file,
does not mark the file as changed, and is not affected by undo.
"""

import queue
from collections.abc import Sequence

import bpy

from blender_rl_guiding.scene.description import Loss

from ..areas import redraw
from ..registering import holding
from .reveal import reveal


class RLG_Loss(bpy.types.PropertyGroup):
    """A `Loss` for Blender's lists."""

    object: bpy.props.StringProperty()
    where: bpy.props.StringProperty()
    detail: bpy.props.StringProperty()

    @property
    def loss(self) -> Loss:
        """As plain data."""
        return Loss(self.object, self.where, self.detail)


def _on_click(coverage: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    bpy.ops.rl_guided.show_loss("EXEC_DEFAULT", True)  # True: the click gets its own undo step


class RLG_Coverage(bpy.types.PropertyGroup):
    """The list, and the scene that it is about."""

    scene: bpy.props.StringProperty(description="Name of the scene that was checked; empty before the first check")
    fault: bpy.props.StringProperty(description="Why the scene cannot be rendered; empty if it can")
    losses: bpy.props.CollectionProperty(type=RLG_Loss)
    active: bpy.props.IntProperty(
        name="Loss", description="Click to select the thing that the line names", default=-1, min=-1, update=_on_click
    )


_LOOK = 0.25  # seconds between two looks at the queue
_told: queue.SimpleQueue[tuple[str, Sequence[Loss], str]] = queue.SimpleQueue()


def tell(scene: str, losses: Sequence[Loss], fault: str = "") -> None:
    """Show the losses of a scene, by its name. Callable from any thread, because with a window, engines render in a separate thread."""
    if bpy.app.background:
        show(scene, losses, fault)
    else:
        _told.put((scene, losses, fault))  # because only the main thread may change Blender's data or register a timer


def _show_told() -> float:
    """Empty the queue, in the main thread. Returns the seconds until the next call."""
    while not _told.empty():
        show(*_told.get())
    return _LOOK


def show(scene: str, losses: Sequence[Loss], fault: str = "") -> None:
    """As `tell`, but immediately. Only for the main thread."""
    coverage = bpy.data.window_managers[0].rl_guiding_coverage
    coverage.property_unset("active")  # set directly, so the update function of a click does not run
    coverage.scene, coverage.fault = scene, fault
    coverage.losses.clear()
    for loss in losses:
        line = coverage.losses.add()
        line.object, line.where, line.detail = loss.object, loss.where, loss.detail
    redraw("PROPERTIES")


@bpy.app.handlers.persistent
def _forget(_: object) -> None:
    """Clear the list, because another file has been opened."""
    show("", ())


class RLG_OT_show_loss(bpy.types.Operator):
    """See `reveal`."""

    bl_idname = "rl_guided.show_loss"
    bl_label = "Show in Scene"
    bl_description = "Select the thing that the chosen line names"
    bl_options = {"UNDO", "INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        coverage = context.window_manager.rl_guiding_coverage
        if not 0 <= coverage.active < len(coverage.losses):
            return {"CANCELLED"}
        if missing := reveal(coverage.losses[coverage.active].loss, context):
            self.report({"INFO"}, missing)
        return {"FINISHED"}


_CLASSES = (RLG_OT_show_loss, RLG_Loss, RLG_Coverage)
_register, _unregister = holding(bpy.types.WindowManager, "rl_guiding_coverage", _CLASSES, "Coverage")


def register() -> None:
    """The list as `window_manager.rl_guiding_coverage`."""
    _register()
    bpy.app.handlers.load_post.append(_forget)
    if not bpy.app.background:
        bpy.app.timers.register(_show_told, persistent=True)


def unregister() -> None:
    """Undo `register`."""
    if bpy.app.timers.is_registered(_show_told):
        bpy.app.timers.unregister(_show_told)
    bpy.app.handlers.load_post.remove(_forget)
    _unregister()
