"""Repairs settings in files from other versions of the add-on: unknown choices, and numbers beyond their limits.

Blender itself only drops unknown properties.
"""

from collections.abc import Iterator
from typing import Any

import bpy

from blender_rl_guiding.schema import Settings, entries
from blender_rl_guiding.settings import Render
from blender_rl_guiding.strings import say


def repair(group: bpy.types.PropertyGroup, config: type[Settings]) -> Iterator[str]:
    """Set unknown choices to their defaults, numbers to the nearest limit; yields a line, "name is now value", for each change."""
    for entry in entries(config):
        old = getattr(group, entry.name)
        if entry.type is not bool and group.is_property_set(entry.name):
            if old == "":
                group.property_unset(entry.name)
            else:
                setattr(group, entry.name, old)  # Blender clamps it
            new = getattr(group, entry.name)
            if new != old:
                yield f"{config.kind}.{entry.name} is now {new}"
        for kind, variant in entry.variants.items():
            yield from repair(getattr(group, f"{entry.name}_{kind}"), variant)


@bpy.app.handlers.persistent
def repair_all(*_: Any) -> None:
    """Repair every scene of the open file; print a line for each change."""
    for scene in bpy.data.scenes:
        if scene.library is None:
            for change in repair(scene.rl_guiding, Render):
                say(f"RL Guided: scene '{scene.name}' was saved by another version: {change}")


_HANDLERS = ("load_post", "blend_import_post")  # opened, and appended


def register() -> None:
    """Register the repair of each file that is opened or appended."""
    for name in _HANDLERS:
        getattr(bpy.app.handlers, name).append(repair_all)


def unregister() -> None:
    """Undo `register`."""
    for name in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(repair_all)
