"""Settings classes as Blender properties: PropertyGroups generated from `blender_rl_guiding.settings`, and the ways in and out.

A union of settings classes becomes a menu, plus one group for each variant: `guide`, `guide_dqn`, `guide_bsdf`.
"""

from typing import Any

import bpy
import numpy as np

from blender_rl_guiding.schema import Entry, Settings, entries
from blender_rl_guiding.settings import Render

_NUMBERS = {bool: (bpy.props.BoolProperty, {}), int: (bpy.props.IntProperty, {}), float: (bpy.props.FloatProperty, {"precision": 5})}


def make_groups(default: Settings, name: str = "RLG") -> list[type]:
    """The PropertyGroup of a settings class, last, after the groups that it points to; unregistered, with defaults as in `default`."""
    groups: list[type] = []
    annotations: dict[str, Any] = {}
    for entry in entries(type(default)):
        value = getattr(default, entry.name)
        annotations[entry.name] = _property(entry, value)
        for kind, variant in entry.variants.items():
            inner = make_groups(value if kind == value.kind else variant(), f"{name}_{entry.name}_{kind}")
            groups += inner
            annotations[f"{entry.name}_{kind}"] = bpy.props.PointerProperty(type=inner[-1])
    return [*groups, type(name, (bpy.types.PropertyGroup,), {"__annotations__": annotations})]


def _property(entry: Entry, value: Any) -> Any:
    text = {"name": entry.label, "description": entry.doc.rstrip(".")}
    if entry.variants:
        items = [(kind, variant.__name__, (variant.__doc__ or "").rstrip(".")) for kind, variant in entry.variants.items()]
        return bpy.props.EnumProperty(items=items, default=value.kind, **text)
    if entry.choices:
        items = [(choice, choice.capitalize(), "") for choice in entry.choices]
        return bpy.props.EnumProperty(items=items, default=value, **text)
    make, extra = _NUMBERS[entry.type]
    limits = {side: limit for side, limit in zip(("min", "max"), entry.limits, strict=True) if limit is not None}
    return make(default=value, **text, **limits, **extra)


def read(group: bpy.types.PropertyGroup, config: type[Settings]) -> Any:
    """The settings object that the values shown in Blender stand for."""
    values = {}
    for entry in entries(config):
        value = getattr(group, entry.name)
        if entry.variants:
            value = read(getattr(group, f"{entry.name}_{value}"), entry.variants[value])
        elif entry.type is float:
            value = float(str(np.float32(value)))  # Blender keeps 32 bits: 0.1 comes back as 0.10000000149
        values[entry.name] = value
    return config(**values)


def write(group: bpy.types.PropertyGroup, settings: Settings) -> None:
    """Show a settings object in Blender; variants that it does not choose keep their values."""
    for entry in entries(type(settings)):
        value = getattr(settings, entry.name)
        if entry.variants:
            write(getattr(group, f"{entry.name}_{value.kind}"), value)
            value = value.kind
        setattr(group, entry.name, value)


_GROUPS = make_groups(Render())
RENDER_GROUP = _GROUPS[-1]  # what `read` takes as a `Render`


def register() -> None:
    """The groups, and the settings as `scene.rl_guiding`."""
    for group in _GROUPS:
        bpy.utils.register_class(group)
    bpy.types.Scene.rl_guiding = bpy.props.PointerProperty(type=_GROUPS[-1], name="RL Guided")


def unregister() -> None:
    """Undo `register`."""
    del bpy.types.Scene.rl_guiding
    for group in reversed(_GROUPS):
        bpy.utils.unregister_class(group)
