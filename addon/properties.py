"""Settings classes as Blender properties: PropertyGroups generated from `blender_rl_guiding.settings`, and the ways in and out.

A union of settings classes becomes a menu, plus one group for each variant: `guide`, `guide_dqn`, `guide_bsdf`.
"""

import zlib
from typing import Any

import bpy
import numpy as np

from blender_rl_guiding.schema import Entry, Settings, entries
from blender_rl_guiding.settings import Render

_DIGITS = 3  # after the point; Blender adds more where a small number would be shown as 0
_CLICKS = 100  # on an arrow of a number's field, from one soft limit to the other
_UNITS = {"": {}, "share": {"subtype": "FACTOR"}, "seconds": {"unit": "TIME_ABSOLUTE"}}
_NUMBERS = {bool: bpy.props.BoolProperty, int: bpy.props.IntProperty, float: bpy.props.FloatProperty}


def make_groups(default: Settings, name: str = "RLG") -> list[type]:
    """The PropertyGroup of a settings class, last, after the groups that it points to; unregistered, with defaults as in `default`."""
    groups: list[type] = []
    annotations: dict[str, Any] = {}
    for entry in entries(type(default)):
        value = getattr(default, entry.name)
        annotations[entry.name] = _property(entry, value, animated=isinstance(default, Render) and entry.type in (int, float))
        for kind, variant in entry.variants.items():
            inner = make_groups(value if kind == value.kind else variant(), f"{name}_{entry.name}_{kind}")
            groups += inner
            annotations[f"{entry.name}_{kind}"] = bpy.props.PointerProperty(type=inner[-1])
    return [*groups, type(name, (bpy.types.PropertyGroup,), {"__annotations__": annotations})]


def _property(entry: Entry, value: Any, animated: bool) -> Any:
    """Animated is what each frame may have of its own: numbers of the render. A guide is of one kind and size throughout."""
    common = {"name": entry.label, "description": _sentence(entry.doc), "options": {"ANIMATABLE"} if animated else set()}
    if entry.variants:
        items = [(kind, variant.label, _sentence(variant.__doc__)) for kind, variant in entry.variants.items()]
        return bpy.props.EnumProperty(items=_numbered(items), default=value.kind, **common)
    if entry.choices:
        items = [(choice, label, "") for choice, label in entry.choices.items()]
        return bpy.props.EnumProperty(items=_numbered(items), default=value, **common)
    return _NUMBERS[entry.type](default=value, **common, **_limits(entry), **_look(entry))


def _numbered(items: list[tuple[str, str, str]]) -> list[tuple[str, str, str, str, int]]:
    """Items with numbers made from their names: a file keeps the number alone, and counted ones would shift when an item is inserted."""
    return [(*item, "NONE", zlib.crc32(item[0].encode()) & 0x7FFFFFFF) for item in items]


def _sentence(text: str | None) -> str:
    """Blender adds the full stop of a tooltip by itself."""
    return (text or "").rstrip(".")


def _limits(entry: Entry) -> dict[str, Any]:
    hard = zip(("min", "max"), entry.limits, strict=True)
    soft = zip(("soft_min", "soft_max"), entry.soft, strict=True)
    return {side: limit for side, limit in (*hard, *soft) if limit is not None}


def _look(entry: Entry) -> dict[str, Any]:
    """How a number with a point is shown and stepped."""
    if entry.type is not float:
        return {}
    low, high = entry.soft
    step = {} if low is None or high is None else {"step": 100 * (high - low) / _CLICKS}  # Blender counts steps in hundredths
    return {"precision": _DIGITS, **step, **_UNITS[entry.unit]}


def read(group: bpy.types.PropertyGroup, config: type[Settings]) -> Any:
    """The settings object that the values shown in Blender stand for. For a frame, ask the evaluated scene: some are animated."""
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
