"""Presets: the built-in ones, and the user's own as files in Blender's presets folder, in a menu of the first panel's header.

A preset of the user's is JSON that `rlg render --settings` reads, too. Applying a preset keeps the settings of variants that are not
chosen. One undo step reverts it.
"""

import json
from pathlib import Path
from typing import Any

import bpy
from bl_ui.utils import PresetPanel

from blender_rl_guiding.errors import InputError, atomic, trying_to
from blender_rl_guiding.schema import entries, from_dict, from_file, to_dict
from blender_rl_guiding.settings import PRESETS, Render

from .acting import Acting
from .properties import read, write

_FOLDER = "presets/rl_guided"  # below the user's scripts, as for all presets of Blender


def apply(scene: bpy.types.Scene, name: str) -> None:
    """Choose a built-in preset. Settings that no preset changes, such as samples and seed, stay."""
    present, preset = to_dict(read(scene.rl_guiding, Render)), to_dict(PRESETS[name].settings)
    write(scene.rl_guiding, from_dict(Render, present | {setting: preset[setting] for setting in subjects()}))


def subjects() -> set[str]:
    """The settings that any built-in preset changes."""
    default = Render()
    settings = [preset.settings for preset in PRESETS.values()]
    names = [entry.name for entry in entries(Render)]
    return {name for name in names if any(getattr(one, name) != getattr(default, name) for one in settings)}


def files() -> list[Path]:
    """The user's presets, in the order of their names."""
    folder = bpy.utils.user_resource("SCRIPTS", path=_FOLDER)
    return sorted(Path(folder).glob("*.json")) if folder else []


def path_of(name: str) -> Path:
    """The file of the user's preset with that name. Its folder may not exist yet. InputError if Blender has no folder for presets."""
    folder = bpy.utils.user_resource("SCRIPTS", path=_FOLDER)
    if not folder:
        raise InputError("there is no folder for presets")
    return Path(folder) / f"{bpy.path.clean_name(name.strip())}.json"


def shown_name(path: Path) -> str:
    """A file's name in the menu."""
    return bpy.path.display_name(path.name, title_case=False)


def load(scene: bpy.types.Scene, path: Path) -> None:
    """Set all settings from a file. The InputError names the file and its fault."""
    write(scene.rl_guiding, from_file(Render, path, path.name))


def add(scene: bpy.types.Scene, name: str) -> Path:
    """Save all settings of a scene as a preset. InputError if the name exists already, or the file cannot be written."""
    path = path_of(name)
    if not name.strip():
        raise InputError("a preset needs a name")
    if path.exists():
        raise InputError(f"there is a preset '{shown_name(path)}' already")
    with atomic(path) as part:
        part.write_text(json.dumps(to_dict(read(scene.rl_guiding, Render)), indent=1), encoding="utf-8")
    return path


def remove(name: str) -> None:
    """Delete one of the user's presets. InputError if no preset has that name, or the file cannot be deleted."""
    path = path_of(name)
    with trying_to(f"remove {path}"):
        path.unlink()


class RLG_OT_preset_apply(Acting):
    """See `apply`."""

    bl_idname = "rl_guided.preset_apply"
    bl_label = "Apply Preset"
    bl_options = {"UNDO", "INTERNAL"}

    name: bpy.props.StringProperty(options={"SKIP_SAVE"})

    @classmethod
    def description(cls, context: bpy.types.Context, properties: Any) -> str:
        return PRESETS[properties.name].doc.rstrip(".")

    def act(self, context: bpy.types.Context) -> None:
        if self.name not in PRESETS:
            raise InputError(f"no preset is called {self.name!r}")
        apply(context.scene, self.name)


class RLG_OT_preset_load(Acting):
    """See `load`."""

    bl_idname = "rl_guided.preset_load"
    bl_label = "Load Preset"
    bl_description = "Take over all settings of this preset"
    bl_options = {"UNDO", "INTERNAL"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})

    def act(self, context: bpy.types.Context) -> None:
        load(context.scene, Path(self.filepath))


class RLG_OT_preset_add(Acting):
    """See `add`."""

    bl_idname = "rl_guided.preset_add"
    bl_label = "Add Preset"
    bl_description = "Keep the present settings as a preset of this name"
    bl_options = {"INTERNAL"}

    name: bpy.props.StringProperty(options={"SKIP_SAVE"})

    def act(self, context: bpy.types.Context) -> None:
        add(context.scene, self.name)


class RLG_OT_preset_remove(Acting):
    """See `remove`."""

    bl_idname = "rl_guided.preset_remove"
    bl_label = "Remove Preset"
    bl_description = "Delete this preset's file"
    bl_options = {"INTERNAL"}

    name: bpy.props.StringProperty(options={"SKIP_SAVE"})

    def act(self, context: bpy.types.Context) -> None:
        remove(self.name)


class RLG_PT_presets(PresetPanel, bpy.types.Panel):
    """The menu: the built-in ones, then the user's."""

    bl_label = "Presets"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.emboss = "PULLDOWN_MENU"
        layout.operator_context = "EXEC_DEFAULT"
        column = layout.column(align=True)
        for name, preset in PRESETS.items():
            column.operator(RLG_OT_preset_apply.bl_idname, text=preset.label, translate=False).name = name
        layout.separator()
        self._draw_own(layout.column(align=True), context)

    def _draw_own(self, column: bpy.types.UILayout, context: bpy.types.Context) -> None:
        """The user's presets, each with a button that removes it, and a field for the name of a new one."""
        for path in files():
            row = column.row(align=True)
            row.operator(RLG_OT_preset_load.bl_idname, text=shown_name(path), translate=False).filepath = str(path)
            row.operator(RLG_OT_preset_remove.bl_idname, text="", icon="REMOVE").name = path.stem
        row = column.row()
        field = row.row()
        field.emboss = "NORMAL"
        field.prop(context.window_manager, "preset_name", text="")
        row.operator(RLG_OT_preset_add.bl_idname, text="", icon="ADD").name = context.window_manager.preset_name


_CLASSES = (RLG_OT_preset_apply, RLG_OT_preset_load, RLG_OT_preset_add, RLG_OT_preset_remove, RLG_PT_presets)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
