"""The methods of a comparison: into the list in the file, and out of it as settings."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, get_args

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.schema import Entry, Settings, SettingsError, active, entries, flags, override
from blender_rl_guiding.settings import PRESETS, Guide, Render
from blender_rl_guiding.strings import fault_of_name

from ..properties import read, write


def built_in() -> list[str]:
    """The names of guides with their defaults, and of presets."""
    return [*(guide.kind for guide in get_args(Guide)), *PRESETS]


def add(comparison: bpy.types.PropertyGroup, name: str, settings: Render) -> None:
    """Add a method at the end and make it the active one; a name that is taken gets a number."""
    taken = {item.name for item in comparison.methods}
    item = comparison.methods.add()
    item.name = _free(name, taken)
    write(item.settings, settings)
    comparison.active_method = len(comparison.methods) - 1


def _free(name: str, taken: set[str]) -> str:
    """The name, or the first of "name 2", "name 3" that is free."""
    return next(found for k in range(1, len(taken) + 2) if (found := name if k == 1 else f"{name} {k}") not in taken)


def settings_of(item: bpy.types.PropertyGroup) -> Render:
    """The settings of a method in the list. InputError where they come from another version that had other choices or limits."""
    if menu := next(_unknown(item.settings, Render), None):
        raise InputError(f"method '{item.name}': its {menu.label} was chosen in another version of the add-on; choose it again")
    try:
        return read(item.settings, Render)
    except SettingsError as error:
        raise InputError(f"method '{item.name}': {error}") from error


def _unknown(group: bpy.types.PropertyGroup, config: type[Settings]) -> Iterator[Entry]:
    """The menus whose chosen item this version does not have."""
    for entry in entries(config):
        if entry.variants or entry.choices:
            chosen = getattr(group, entry.name)
            if not chosen:
                yield entry
            elif entry.variants:
                yield from _unknown(getattr(group, f"{entry.name}_{chosen}"), entry.variants[chosen])


def all_of(comparison: bpy.types.PropertyGroup) -> dict[str, Render]:
    """The methods to be run, by name, each with the budget of the comparison. InputError where they cannot be compared."""
    names = [item.name for item in comparison.methods]
    if not names:
        raise InputError("there is no method to compare: add some to the list")
    if doubles := [name for name in names if names.count(name) > 1]:
        raise InputError(f"two methods are called '{doubles[0]}': rename one of them")
    for name in names:  # which become names of folders; anybody may have chosen them
        if fault := fault_of_name(name):
            raise InputError(f"method '{name}' {fault}: rename it")
    if comparison.budget == "SAMPLES":
        budget: dict[str, Any] = {"spp": comparison.spp, "seconds": 0.0}
    else:
        budget = {"spp": _MOST_SAMPLES, "seconds": float(f"{comparison.seconds:.6g}")}
    return {item.name: replace(settings_of(item), **budget) for item in comparison.methods}


_MOST_SAMPLES = 1_000_000  # where time is the limit


def sweep(settings: Render, name: str, values: str) -> Iterator[tuple[str, Render]]:
    """Copies of settings in which one has the values of a text, separated by commas; each with what tells it from the others.

    InputError on a value that the setting cannot have.
    """
    entry = dict(flags(Render))[name]
    for text in filter(None, map(str.strip, values.split(","))):
        try:
            yield f"{name.rpartition('.')[2]} {text}", override(settings, {name: _value(entry, text)})
        except (SettingsError, ValueError) as error:
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
    """Values worth trying for a setting, as the text that `sweep` takes: all choices, or half, once and twice the present number."""
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
    """The value of a setting by its flat name, which is active."""
    scope, _, last = name.rpartition(".")
    if not scope or settings.kind == scope:
        return getattr(settings, last)
    inner = (getattr(settings, entry.name) for entry in entries(type(settings)) if entry.variants)
    return next(_present(value, name) for value in inner if name in set(_below(value)))


def _below(settings: Settings) -> Iterator[str]:
    return active(settings, f"{settings.kind}.")
