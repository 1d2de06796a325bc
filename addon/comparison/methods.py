"""The methods of a comparison: converts settings to entries of the file's list, and back."""

from collections.abc import Iterator
from typing import Any

import bpy

from blender_rl_guiding.comparison import Comparison
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.flat import active, flags, override
from blender_rl_guiding.schema import Entry, Settings, entries, named
from blender_rl_guiding.settings import Render

from ..properties import read, write

_METHODS = next(entry for entry in entries(Comparison) if entry.name == "methods")


def add(comparison: bpy.types.PropertyGroup, name: str, settings: Render) -> None:
    """Add a method at the end and make it the active one. If its name exists already, it gets a number."""
    taken = {item.name for item in comparison.methods}
    item = comparison.methods.add()
    item.name = _free(name, taken)
    write(item.settings, settings)
    comparison.active_method = len(comparison.methods) - 1


def _free(name: str, taken: set[str]) -> str:
    """The name, or the first of "name 2", "name 3" that is free."""
    return next(found for k in range(1, len(taken) + 2) if (found := name if k == 1 else f"{name} {k}") not in taken)


def settings_of(item: bpy.types.PropertyGroup) -> Render:
    """The settings of a method in the list. InputError if another version saved a choice or number that this version does not allow."""
    return named(_METHODS, item.name, read, item.settings, Render)


def sweep(settings: Render, name: str, values: str) -> Iterator[tuple[str, Render]]:
    """Copies of settings, one for each comma-separated value of one setting. Each comes with the part of its name that differs.

    InputError on a value that the setting cannot have.
    """
    entry = dict(flags(Render))[name]
    for text in filter(None, map(str.strip, values.split(","))):
        try:
            yield f"{name.rpartition('.')[2]} {text}", override(settings, {name: _value(entry, text)})
        except (InputError, ValueError) as error:
            raise InputError(f"{entry.label} cannot be {text!r}: {error}") from error


def _value(entry: Entry, text: str) -> Any:
    if entry.type is bool:
        return _SWITCH.get(text.lower(), text)
    return text if entry.variants or entry.choices else entry.type(text)


_SWITCH = {"on": True, "off": False, "true": True, "false": False}


def sweepable(settings: Render) -> list[tuple[str, str, str]]:
    """The settings that have an effect in `settings`, as items of a menu: flat name, label, help."""
    known = dict(flags(Render))
    left_out = {"spp", "seconds", "seed"}  # the comparison's own
    return [(name, _label(name, known[name]), known[name].doc.rstrip(".")) for name in active(settings) if name not in left_out]


def _label(name: str, entry: Entry) -> str:
    scope = name.rpartition(".")[0]
    return f"{entry.label} ({scope})" if scope else entry.label


def example(settings: Render, name: str) -> str:
    """Suggested values for a setting, as the text for `sweep`: all choices, or 1/2, 1 and 2 times the present number."""
    entry = dict(flags(Render))[name]
    if entry.variants or entry.choices:
        return ", ".join([*entry.variants, *entry.choices])
    if entry.type is bool:
        return "off, on"
    present = _present(settings, name)
    low, high = entry.limits
    tried = [entry.type(present * factor) for factor in (0.5, 1, 2)]
    return ", ".join(
        dict.fromkeys(
            f"{value:.6g}" if entry.type is float else str(value)
            for value in tried
            if (low is None or value >= low) and (high is None or value <= high)
        )
    )


def _present(settings: Settings, name: str) -> Any:
    """The value of an active setting by its flat name."""
    scope, _, last = name.rpartition(".")
    if not scope or settings.kind == scope:
        return getattr(settings, last)
    inner = (getattr(settings, entry.name) for entry in entries(type(settings)) if entry.variants)
    return next(_present(value, name) for value in inner if name in active(value, f"{value.kind}."))
