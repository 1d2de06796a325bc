"""The add-on's preferences: the renderer's Python, and its missing parts."""

import bpy

from blender_rl_guiding.environment import Part
from blender_rl_guiding.errors import InputError

from .areas import redraw
from .installation import Check, check, python
from .text import draw_text

INTERVAL = 0.1  # seconds between two queries of a running check


class RLG_OT_check_environment(bpy.types.Operator):
    """Checks the environment. The button starts the check in the background."""

    bl_idname = "rl_guided.check_environment"
    bl_label = "Check Environment"
    bl_description = "Check that the renderer's environment has all parts that rendering needs. Nothing is installed"

    running: Check | None = None
    parts: tuple[Part, ...] = ()  # what the last check found

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if bpy.app.background:  # timers never fire without a window
            return self.execute(context)
        start()
        return {"FINISHED"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """For scripts: blocks until the answer is there."""
        forget()
        type(self).parts = tuple(check())
        faults = [f"{part.name}: {part.problem}" for part in self.parts if part.problem]
        self.report({"WARNING" if faults else "INFO"}, "; ".join(faults) or "The renderer's environment has all it needs")
        return {"FINISHED"}


class RLG_OT_copy(bpy.types.Operator):
    """Puts a command on the clipboard."""

    bl_idname = "rl_guided.copy"
    bl_label = "Copy Command"
    bl_description = "Copy the command, to be pasted into a terminal"
    bl_options = {"INTERNAL"}

    text: bpy.props.StringProperty(options={"SKIP_SAVE"})  # pyright: ignore[reportInvalidTypeForm]  # Blender's own way

    def execute(self, context: bpy.types.Context) -> set[str]:
        context.window_manager.clipboard = self.text
        return {"FINISHED"}


class RLG_preferences(bpy.types.AddonPreferences):
    """Settings that hold for all files of a user."""

    bl_idname = __package__

    python: bpy.props.StringProperty(  # pyright: ignore[reportInvalidTypeForm]
        name="Renderer's Python",
        description="Python of the renderer's environment. If it is empty, the environment that ./build.sh setup made last is used",
        subtype="FILE_PATH",
        update=lambda self, context: forget(),
    )

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.prop(self, "python", placeholder="The one that ./build.sh setup made last")
        _draw_found(layout, context)
        row = layout.row()
        running = RLG_OT_check_environment.running is not None
        row.enabled = not running
        row.operator(RLG_OT_check_environment.bl_idname, text="Checking ..." if running else "Check Environment")
        if RLG_OT_check_environment.parts:
            _draw_parts(layout.box(), RLG_OT_check_environment.parts, context)


def _draw_found(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    try:
        layout.label(text=f"Renders with {python()}", icon="CONSOLE")
    except InputError as error:
        draw_text(layout.column(align=True), str(error), context, "ERROR")


def _draw_parts(layout: bpy.types.UILayout, parts: tuple[Part, ...], context: bpy.types.Context) -> None:
    """First the faulty parts, each with the command that repairs it; then the other parts."""
    for part in parts:
        if part.problem:
            draw_text(layout.column(align=True), f"{part.name}: {part.problem}", context, "ERROR")
            row = layout.row()
            row.label(text=part.command, icon="BLANK1")
            row.operator(RLG_OT_copy.bl_idname, text="", icon="COPYDOWN").text = part.command
            layout.separator(type="LINE")
    flow = layout.column_flow(columns=3)
    for part in parts:
        if not part.problem:
            flow.label(text=f"{part.name} {part.version}", icon="CHECKMARK")


def start() -> None:
    """Check in the background; `poll` shows the result."""
    forget()
    RLG_OT_check_environment.running = Check()
    bpy.app.timers.register(poll, first_interval=INTERVAL, persistent=True)


def poll() -> float | None:
    """Show the result of a finished check. Returns the seconds until the next query, or None."""
    running = RLG_OT_check_environment.running
    if running and not running.done():
        return INTERVAL
    if running:
        RLG_OT_check_environment.parts = tuple(running.parts())
        RLG_OT_check_environment.running = None
        redraw("PREFERENCES")
    return None


def forget() -> None:
    """End the running check, and forget the last result."""
    if bpy.app.timers.is_registered(poll):
        bpy.app.timers.unregister(poll)
    if RLG_OT_check_environment.running:
        RLG_OT_check_environment.running.stop()
    RLG_OT_check_environment.running = None
    RLG_OT_check_environment.parts = ()


register, _unregister = bpy.utils.register_classes_factory((RLG_OT_check_environment, RLG_OT_copy, RLG_preferences))


def unregister() -> None:
    """Undo `register`."""
    forget()
    _unregister()
