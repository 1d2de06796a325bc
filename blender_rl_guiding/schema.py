"""What a settings class says about itself: fields, limits, variants, help; and the ways in and out of it.

A settings class is a frozen dataclass that derives from `Settings`, each field declared by `setting(...)`. A field is a
bool, int, float, a `Literal` of strings (a choice), or a union of settings classes (a menu of variants).
Command line, JSON, validation and Blender properties are all derived from `entries`.
"""

import difflib
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from types import UnionType
from typing import Any, ClassVar, Literal, TypeVar, get_args, get_origin, get_type_hints

from .typed import shown

LARGEST = 1 << 1023  # whole number that surely is a float, too


class SettingsError(ValueError):
    """A setting that does not exist or has a value that it cannot have; the message is one line that names it."""


Unit = Literal["", "share", "seconds"]


def setting(
    default: Any,
    doc: str,
    *,
    min: float | None = None,
    max: float | None = None,
    soft: tuple[float, float] | None = None,
    unit: Unit = "",
    label: str = "",
    choices: Mapping[str, str] | None = None,
    panel: str = "",
    when: tuple[str, str] | None = None,
) -> Any:
    """Declare one setting: its default, one sentence of help and its inclusive limits. What follows is for panels alone.

    `soft`: the limits that dragging keeps to, where people seldom leave them; `label`, and `choices` for the labels of a choice's
    values: where their names will not do; `panel`: the setting opens a panel of this title, and those declared after it join it;
    `when`: a choice of the same class and its value without which the setting has no effect.
    """
    return field(
        default=default,
        metadata={
            "doc": doc,
            "limits": (min, max),
            "soft": soft or (min, max),
            "unit": unit,
            "label": label,
            "choices": choices or {},
            "panel": panel,
            "when": when,
        },
    )


class Settings:
    """Base of every settings class; an instance outside its limits cannot exist.

    `kind` is the class's name in files and on the command line, `label` for people; both come from the class's own name if not given.
    """

    kind: ClassVar[str]
    label: ClassVar[str]

    def __init_subclass__(cls, kind: str | None = None, label: str | None = None) -> None:
        cls.kind = kind or cls.__name__.lower()
        cls.label = label or cls.__name__

    def __post_init__(self) -> None:
        for entry in entries(type(self)):
            object.__setattr__(self, entry.name, _checked(entry, getattr(self, entry.name), f"{self.kind}.{entry.name}"))


SettingsType = TypeVar("SettingsType", bound=Settings)


Variants = dict[str, type[Settings]]  # by kind


@dataclass(frozen=True)
class Entry:
    """One field of a settings class, as the command line and the add-on see it."""

    name: str
    type: Any  # bool, int, float, str for a choice, Settings for a variant
    default: Any
    doc: str
    label: str  # what a panel shows
    limits: tuple[float | None, float | None]
    soft: tuple[float | None, float | None]  # `limits`, or narrower
    unit: Unit
    choices: dict[str, str]  # labels by value; empty unless the field is a Literal
    variants: Variants  # empty unless the field is a union of settings classes
    panel: str  # title; empty where the field is shown with the menu that its class is chosen from
    when: tuple[str, str] | None  # another field, and the value that it must have for this one to have an effect


def entries(config: type[Settings]) -> Iterator[Entry]:
    """The fields of a settings class in the order of their declaration."""
    hints, panel = get_type_hints(config), ""
    for f in fields(config):  # type: ignore[arg-type]  # every settings class is a dataclass
        hint = hints[f.name]
        variants = {v.kind: v for v in get_args(hint)} if isinstance(hint, UnionType) else {}
        values = get_args(hint) if get_origin(hint) is Literal else ()
        choices = {value: value.capitalize() for value in values} | dict(f.metadata["choices"])
        kind = str if choices else Settings if variants else hint
        said = {key: f.metadata[key] for key in ("doc", "limits", "soft", "unit", "when")}
        panel = f.metadata["panel"] or panel
        label = f.metadata["label"] or f.name.replace("_", " ").title()
        yield Entry(f.name, kind, f.default, label=label, choices=choices, variants=variants, panel=panel, **said)


def _checked(entry: Entry, value: Any, path: str) -> Any:
    """Return the value in the field's own type, or raise SettingsError."""
    if entry.variants:
        if type(value) not in entry.variants.values():
            raise SettingsError(f"{path}={shown(value)} is not one of {', '.join(entry.variants)}")
        return value
    if entry.choices:
        if not isinstance(value, str) or value not in entry.choices:
            raise SettingsError(f"{path}={shown(value)} is not one of {', '.join(entry.choices)}")
        return value
    if entry.type is float and type(value) is int:
        value = float(value) if abs(value) < LARGEST else math.inf
    if type(value) is not entry.type:
        raise SettingsError(f"{path}={shown(value)} is not of type {entry.type.__name__}")
    low, high = entry.limits
    outside = (low is not None and value < low) or (high is not None and value > high)
    if outside or (entry.type is float and not math.isfinite(value)):
        limits = " and ".join([f"at least {low}"] * (low is not None) + [f"at most {high}"] * (high is not None))
        raise SettingsError(f"{path}={shown(value)} is out of range: must be {limits or 'finite'}")
    return value


def to_dict(config: Settings) -> dict[str, Any]:
    """Plain data for JSON; a variant is written as {"kind": its name, ...}."""
    values: dict[str, Any] = {}
    for entry in entries(type(config)):
        value = getattr(config, entry.name)
        values[entry.name] = {"kind": value.kind} | to_dict(value) if entry.variants else value
    return values


def from_dict(config: type[SettingsType], values: Any) -> SettingsType:
    """Inverse of `to_dict`. Missing values keep their defaults; SettingsError on unknown names and bad values."""
    if not isinstance(values, Mapping):
        raise SettingsError(f"{config.kind}={shown(values)} is not a group of settings")
    known = {entry.name: entry for entry in entries(config)}
    kwargs = {}
    for name, value in values.items():
        if name not in known:
            raise SettingsError(f"{config.kind} has no setting {shown(name)}{_hint(name, known)}")
        if variants := known[name].variants:
            rest = dict(value) if isinstance(value, Mapping) else {"kind": value}
            chosen = rest.pop("kind", None)
            if not isinstance(chosen, str) or chosen not in variants:
                raise SettingsError(f"{config.kind}.{name}={shown(chosen)} is not one of {', '.join(variants)}{_hint(chosen, variants)}")
            value = from_dict(variants[chosen], rest)
        kwargs[name] = value
    return config(**kwargs)


def flags(config: type[Settings], scope: str = "") -> Iterator[tuple[str, Entry]]:
    """Every setting below a class by its flat name: "samples", "guide", "dqn.batch", "frequency.octaves"."""
    for entry in entries(config):
        yield scope + entry.name, entry
        for kind, variant in entry.variants.items():
            yield from flags(variant, f"{kind}.")


def override(config: SettingsType, changes: Mapping[str, Any]) -> SettingsType:
    """Replace settings by their flat names (see `flags`); a chosen variant keeps its values if it is the present one.

    SettingsError where a name does not exist or belongs to a variant that is not chosen.
    """
    known = dict(flags(type(config)))
    for name in changes:
        if name not in known:
            raise SettingsError(f"no setting is called {shown(name)}{_hint(name, known)}")
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


def _variant(entry: Entry, present: Settings, kind: str, name: str) -> Settings:
    if not isinstance(kind, str) or kind not in entry.variants:
        raise SettingsError(f"{name}={shown(kind)} is not one of {', '.join(entry.variants)}{_hint(kind, entry.variants)}")
    return present if present.kind == kind else entry.variants[kind]()


def _hint(name: Any, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(str(name), list(known), n=1)
    return f"; did you mean {close[0]!r}?" if close else ""
