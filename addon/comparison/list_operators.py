"""Operators and menus of the list of methods: add, remove, move, duplicate, sweep over one setting."""

# pyright: reportInvalidTypeForm=false

from typing import Any

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.settings import METHODS, Render, method

from ..acting import Acting
from ..properties import read, write
from . import methods

_KEPT: list[tuple[str, str, str]] = []  # the last menu's items: Blender keeps no reference to the texts of a dynamic menu
_PUBLISHED = "slides_"  # prefix of the names of presets with published settings


def _settings(context: bpy.types.Context) -> Render:
    """The settings of the active method. InputError if they cannot be read."""
    comparison = context.scene.rl_guiding_comparison
    return methods.settings_of(comparison.methods[comparison.active_method])


class _Edit(Acting):
    """Changes the list. Only subclasses are registered."""

    bl_options = {"REGISTER", "UNDO", "INTERNAL"}
    needs_method = True

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        comparison = context.scene.rl_guiding_comparison
        return not cls.needs_method or comparison.active_method in range(len(comparison.methods))

    def act(self, context: bpy.types.Context) -> None:
        self.edit(context.scene.rl_guiding_comparison, context)

    def edit(self, comparison: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
        """Change the list. InputError if that is not possible."""
        raise NotImplementedError


class RLG_OT_method_add(_Edit):
    """Add a method to the list."""

    bl_idname = "rl_guided.method_add"
    bl_label = "Add Method"
    needs_method = False

    name: bpy.props.StringProperty(description="A guide or a preset; empty takes the settings of the scene's render")

    @classmethod
    def description(cls, context: bpy.types.Context, properties: Any) -> str:
        return f"Add {properties.name} to the list" if properties.name else "Add the settings of Render properties as they are now"

    def edit(self, comparison: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
        if self.name and self.name not in METHODS:
            raise InputError(f"no guide or preset is called '{self.name}'")
        settings = method(self.name) if self.name else read(context.scene.rl_guiding, Render)
        methods.add(comparison, self.name or settings.guide.kind, settings)


class RLG_OT_method_remove(_Edit):
    """Remove the active method from the list; its results stay."""

    bl_idname = "rl_guided.method_remove"
    bl_label = "Remove Method"

    def edit(self, comparison: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
        comparison.methods.remove(comparison.active_method)
        comparison.active_method = max(0, min(comparison.active_method, len(comparison.methods) - 1))


class RLG_OT_method_move(_Edit):
    """Move the active method; the first is the baseline of all ratios."""

    bl_idname = "rl_guided.method_move"
    bl_label = "Move Method"

    step: bpy.props.IntProperty(default=1)

    def edit(self, comparison: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
        target = comparison.active_method + self.step
        if target in range(len(comparison.methods)):
            comparison.methods.move(comparison.active_method, target)
            comparison.active_method = target


class RLG_OT_method_duplicate(_Edit):
    """Add a copy of the active method."""

    bl_idname = "rl_guided.method_duplicate"
    bl_label = "Duplicate"

    def edit(self, comparison: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
        methods.add(comparison, comparison.methods[comparison.active_method].name, _settings(context))


class RLG_OT_method_apply(_Edit):
    """Render with the settings of the active method: copy them to the render settings of the scene."""

    bl_idname = "rl_guided.method_apply"
    bl_label = "Use for Rendering"

    def edit(self, comparison: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
        write(context.scene.rl_guiding, _settings(context))


def _menu(self: bpy.types.Operator, context: bpy.types.Context | None) -> list[tuple[str, str, str]]:
    _KEPT[:] = methods.sweepable(_settings(context)) if context else []
    return _KEPT


def _show_example(self: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    self.values = methods.example(_settings(context), self.setting)


class RLG_OT_method_sweep(_Edit):
    """Add copies of the active method in which one setting has other values."""

    bl_idname = "rl_guided.method_sweep"
    bl_label = "Sweep a Setting"

    setting: bpy.props.EnumProperty(items=_menu, name="Setting", description="What differs", update=_show_example)
    values: bpy.props.StringProperty(name="Values", description="The values, separated by commas")

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        _show_example(self, context)
        return context.window_manager.invoke_props_dialog(self, title="Sweep a Setting", confirm_text="Add Methods")

    def edit(self, comparison: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
        name = comparison.methods[comparison.active_method].name
        made = list(methods.sweep(_settings(context), self.setting, self.values))
        for suffix, settings in made:
            methods.add(comparison, f"{name} {suffix}", settings)


def _sections() -> list[list[str]]:
    """The names of guides and presets: first with light sampling, as in the scene's own settings; then without; last the published ones."""
    published = [name for name in METHODS if name.startswith(_PUBLISHED)]
    ours = [name for name in METHODS if name not in published]
    return [[name for name in ours if method(name).nee], [name for name in ours if not method(name).nee], published]


class RLG_MT_method_add(bpy.types.Menu):
    """The methods that can be added to the list."""

    bl_idname = "RLG_MT_method_add"
    bl_label = "Add Method"

    def draw(self, context: bpy.types.Context) -> None:
        operator = RLG_OT_method_add.bl_idname
        self.layout.operator(operator, text="Current Render Settings", icon="SCENE").name = ""
        for names in _sections():
            self.layout.separator()
            for name in names:
                self.layout.operator(operator, text=name).name = name


class RLG_MT_method_specials(bpy.types.Menu):
    """The other operators on a method."""

    bl_idname = "RLG_MT_method_specials"
    bl_label = "Methods"

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.operator_context = "INVOKE_DEFAULT"
        self.layout.operator(RLG_OT_method_duplicate.bl_idname, icon="DUPLICATE")
        self.layout.operator(RLG_OT_method_sweep.bl_idname, icon="PARTICLE_DATA", text="Sweep a Setting...")
        self.layout.operator(RLG_OT_method_apply.bl_idname, icon="SCENE")


class RLG_UL_methods(bpy.types.UIList):
    """The methods; the first is the baseline."""

    def draw_item(self, context: Any, layout: Any, data: Any, item: Any, icon: Any, active: Any, prop: str, index: int) -> None:
        row = layout.row()
        row.prop(item, "name", text="", emboss=False, icon="PINNED" if index == 0 else "DOT")
        kind = row.row()
        kind.alignment = "RIGHT"
        kind.active = False
        kind.label(text="baseline" if index == 0 else item.settings.guide)


_CLASSES = (
    RLG_OT_method_add,
    RLG_OT_method_remove,
    RLG_OT_method_move,
    RLG_OT_method_duplicate,
    RLG_OT_method_apply,
    RLG_OT_method_sweep,
    RLG_MT_method_add,
    RLG_MT_method_specials,
    RLG_UL_methods,
)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
