"""Settings by flat names: "samples", "guide", "dqn.batch", "frequency.octaves". Flags and sweeps use them."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from .schema import Entry, Settings, SettingsError, SettingsType, entries, hint, variant_of
from .typed import shown


def flags(config: type[Settings], scope: str = "") -> Iterator[tuple[str, Entry]]:
    """Every setting below a class, by its flat name."""
    for entry in entries(config):
        yield scope + entry.name, entry
        for kind, variant in entry.variants.items():
            yield from flags(variant, f"{kind}.")


def override(config: SettingsType, changes: Mapping[str, Any]) -> SettingsType:
    """Replace settings by their flat names (see `flags`). If a change chooses the present variant, the variant keeps its values.

    SettingsError if a name does not exist, or belongs to a variant that is not chosen.
    """
    known = dict(flags(type(config)))
    for name in changes:
        if name not in known:
            raise SettingsError(f"no setting is called {shown(name)}{hint(name, known)}")
    result, used = _override(config, changes, "")
    for name in changes.keys() - used:
        raise SettingsError(f"{name}={shown(changes[name])} has no effect: {name.split('.')[0]!r} is not chosen")
    return result


def active(config: Settings, scope: str = "") -> Iterator[str]:
    """The flat names that `override` would take without choosing another variant."""
    for entry in entries(type(config)):
        yield scope + entry.name
        if entry.variants:
            chosen = getattr(config, entry.name)
            yield from active(chosen, f"{chosen.kind}.")


def _override(config: SettingsType, changes: Mapping[str, Any], scope: str) -> tuple[SettingsType, set[str]]:
    """The new settings, and the names of the changes that were used."""
    values, used = {}, set()
    for entry in entries(type(config)):
        name, value = scope + entry.name, getattr(config, entry.name)
        if name in changes:
            used.add(name)
            value = _variant(entry, value, changes[name], name) if entry.variants else changes[name]
        if entry.variants:
            value, inner = _override(value, changes, f"{value.kind}.")
            used |= inner
        values[entry.name] = value
    return replace(config, **values), used  # type: ignore[type-var]  # every settings class is a dataclass


def _variant(entry: Entry, present: Settings, kind: Any, name: str) -> Settings:
    chosen = variant_of(entry, kind, name)
    return present if type(present) is chosen else chosen()
