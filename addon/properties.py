"""Settings classes as Blender properties: generates PropertyGroups from the classes, and converts values in both directions.

A union of settings classes becomes a menu, plus one group for each variant: `guide`, `guide_dqn`, `guide_bsdf`.
Named settings become a collection of groups, each with `name` and `settings`.
"""

import zlib
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from blender_rl_guiding.schema import Choice, Entry, Pixel, Settings, SettingsError, entries, named
from blender_rl_guiding.settings import Render

from .registering import holding

_DIGITS = 3  # after the point; Blender adds more where a small number would be shown as 0
_CLICKS = 100  # clicks on the arrow of a number's field from one soft limit to the other
_UNITS = {"": {}, "share": {"subtype": "FACTOR"}, "seconds": {"unit": "TIME_ABSOLUTE"}}
_NUMBERS = {bool: bpy.props.BoolProperty, int: bpy.props.IntProperty, float: bpy.props.FloatProperty}


def make_groups(default: Settings, name: str = "RLG") -> list[type]:
    """The PropertyGroups of a settings class: first the groups that it points to, last its own. Unregistered; `default` has the
    defaults.
    """
    groups, annotations = declared(default, name)
    return [*groups, _group(name, annotations)]


def _group(name: str, annotations: dict[str, Any]) -> type:
    return type(name, (bpy.types.PropertyGroup,), {"__annotations__": annotations})


def declared(default: Settings, name: str) -> tuple[list[type], dict[str, Any]]:
    """The properties of a settings class by name, after the groups that they point to."""
    groups: list[type] = []
    annotations: dict[str, Any] = {}
    for entry in entries(type(default)):
        if entry.of:
            groups.append(_group(f"{name}_{entry.name}", _named(entry)))
            annotations[entry.name] = bpy.props.CollectionProperty(type=groups[-1])
            continue
        value = getattr(default, entry.name)
        annotations[entry.name] = _property(entry, value, animated=isinstance(default, Render) and entry.type in (int, float))
        for kind, variant in entry.variants.items():
            inner = make_groups(value if kind == value.kind else variant(), f"{name}_{entry.name}_{kind}")
            groups += inner
            annotations[f"{entry.name}_{kind}"] = bpy.props.PointerProperty(type=inner[-1])
    return groups, annotations


def _named(entry: Entry) -> dict[str, Any]:
    """The properties of settings that have a name."""
    text = f"Name of the {entry.label.lower()}; its results are in a folder of this name"
    return {
        "name": bpy.props.StringProperty(name="Name", description=text),
        "settings": bpy.props.PointerProperty(type=_GROUP_OF[entry.of]),
    }


def _property(entry: Entry, value: Any, animated: bool) -> Any:
    """Only numbers of the class `Render` can be animated, because a guide keeps its kind and size in all frames."""
    common = {"name": entry.label, "description": _sentence(entry.doc), "options": {"ANIMATABLE"} if animated else set()}
    if entry.variants:
        choices = {kind: Choice(variant.label, variant.__doc__ or "") for kind, variant in entry.variants.items()}
        return bpy.props.EnumProperty(items=_items(choices), default=value.kind, **common)
    if entry.choices:
        return bpy.props.EnumProperty(items=_items(entry.choices), default=value, **common)
    if entry.type is Path:
        common["options"] = {"PATH_SUPPORTS_BLEND_RELATIVE"}  # it may begin with //, the folder of the .blend
        return bpy.props.StringProperty(subtype="FILE_PATH", **common)
    if entry.type == Pixel:
        return bpy.props.IntVectorProperty(size=2, default=value, **common, **_limits(entry))
    return _NUMBERS[entry.type](default=value, **common, **_limits(entry), **_look(entry))


def _items(choices: dict[str, Choice]) -> list[tuple[str, str, str, str, int]]:
    """The choices in panels. A .blend stores only their numbers. Position numbers would shift when we insert a choice."""
    return [
        (name, choice.label, _sentence(choice.doc), "NONE", _number(name) if choice.number is None else choice.number)
        for name, choice in choices.items()
        if choice.label
    ]


def _number(name: str) -> int:
    return zlib.crc32(name.encode()) & 0x7FFFFFFF


def _sentence(text: str | None) -> str:
    """Blender adds the full stop of a tooltip by itself."""
    return (text or "").rstrip(".")


def _limits(entry: Entry) -> dict[str, Any]:
    hard = zip(("min", "max"), entry.limits, strict=True)
    soft = zip(("soft_min", "soft_max"), entry.soft, strict=True)
    return {side: limit for side, limit in (*hard, *soft) if limit is not None}


def _look(entry: Entry) -> dict[str, Any]:
    """Digits, step and unit of a float."""
    if entry.type is not float:
        return {}
    low, high = entry.soft
    step = {} if low is None or high is None else {"step": 100 * (high - low) / _CLICKS}  # Blender counts steps in hundredths
    return {"precision": _DIGITS, **step, **_UNITS[entry.unit]}


def read(group: bpy.types.PropertyGroup, config: type[Settings]) -> Any:
    """The settings object of the values in Blender. Some are animated: for a frame, read the evaluated scene.

    SettingsError if another version saved values that this one does not have.
    """
    return config(**{entry.name: _read(group, entry) for entry in entries(config)})


def _read(group: bpy.types.PropertyGroup, entry: Entry) -> Any:
    value = getattr(group, entry.name)
    if entry.of:
        return tuple((item.name, named(entry, item.name, read, item.settings, entry.of)) for item in value)
    if (entry.variants or entry.choices) and not value:
        raise SettingsError(f"its {entry.label} was chosen in another version of the add-on; choose it again")
    if entry.variants:
        return read(getattr(group, f"{entry.name}_{value}"), entry.variants[value])
    if entry.type is float:
        return float(str(np.float32(value)))  # Blender keeps 32 bits: 0.1 comes back as 0.10000000149
    if entry.type is Path:
        return Path(bpy.path.abspath(value))
    return tuple(value) if entry.type == Pixel else value


def write(group: bpy.types.PropertyGroup, settings: Settings) -> None:
    """Copy a settings object to Blender's properties. Variants that are not chosen keep their values."""
    for entry in entries(type(settings)):
        value = getattr(settings, entry.name)
        if entry.variants:
            write(getattr(group, f"{entry.name}_{value.kind}"), value)
            value = value.kind
        setattr(group, entry.name, value)


_GROUPS = make_groups(Render())
_GROUP_OF: dict[type[Settings] | None, type] = {Render: _GROUPS[-1]}  # for settings that have names

register, unregister = holding(bpy.types.Scene, "rl_guiding", _GROUPS, "RL Guided")
