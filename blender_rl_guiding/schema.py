"""The declaration of settings: fields, limits, variants, help; and the conversion from and to JSON.

A settings class is a frozen dataclass that derives from `Settings`; `setting(...)` declares each field. A field is one of
- bool, int, float, `Path`, `Pixel`,
- a `Literal` of strings: a choice,
- a union of settings classes: a menu of variants,
- `Named[X]`: a list of settings of class X, each under a name of its own.
Command line, JSON, validation and Blender properties all derive from `entries`.
"""

import difflib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import UnionType
from typing import Any, ClassVar, Literal, NamedTuple, TypeVar, get_args, get_origin, get_type_hints

from .errors import InputError, trying_to
from .strings import fault_of_name
from .typed import load, shown

LARGEST = 1 << 1023  # largest whole number that is certainly exact as a float


class SettingsError(InputError):
    """A setting that does not exist, or a value that it cannot have."""


Unit = Literal["", "share", "seconds"]
Pixel = tuple[int, int]  # column and row, from the top left


class Choice(NamedTuple):
    """A value of a choice, as panels show it."""

    label: str  # empty: panels do not offer it
    doc: str = ""
    number: int | None = None  # its number in a .blend; None for a number made from its name


def setting(
    default: Any,
    doc: str,
    *,
    min: float | None = None,
    max: float | None = None,
    soft: tuple[float, float] | None = None,
    unit: Unit = "",
    label: str = "",
    choices: Mapping[str, str | Choice] | None = None,
    panel: str = "",
    when: tuple[str, str] | None = None,
) -> Any:
    """Declare one setting: its default, one sentence of help and its inclusive limits. The rest is for panels.

    `soft`: the limits for dragging with the mouse.
    `label`: the name in panels; without it, the field's own.
    `choices`: label, or label and help, of each value whose name is not good enough as a label.
    `panel`: the setting opens a panel of this title. Settings declared after it join the panel.
    `when`: a choice of the same class, and its value. With any other value the setting has no effect.
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
    """Base of every settings class. No instance is outside its limits.

    `kind` is the name in files and on the command line, `label` the name in panels. The default of both is the class's own name.
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


Named = tuple[tuple[str, SettingsType], ...]  # names are unique, and valid as names of folders
SettingsClass = type[Settings]
Variants = dict[str, SettingsClass]  # by kind


@dataclass(frozen=True)
class Entry:
    """One field of a settings class, as the command line and the add-on see it."""

    name: str
    type: Any  # bool, int, float, Path, Pixel, str for a choice, Settings for a variant, Named
    default: Any
    doc: str
    label: str  # its name in panels
    limits: tuple[float | None, float | None]
    soft: tuple[float | None, float | None]  # `limits`, or narrower
    unit: Unit
    choices: dict[str, Choice]  # by value; empty unless the field is a Literal
    variants: Variants  # empty unless the field is a union of settings classes
    of: SettingsClass | None  # the class of the named settings; None unless the field is Named
    panel: str  # title; if empty, the field is drawn below the menu in which its class is chosen
    when: tuple[str, str] | None  # another field, and its value for which this field has an effect

    @property
    def range(self) -> str:
        """The limits in words; empty if there are none."""
        words = zip(("at least", "at most"), self.limits, strict=True)
        return " and ".join(f"{word} {limit}" for word, limit in words if limit is not None)


def entries(config: type[Settings]) -> Iterator[Entry]:
    """The fields of a settings class in the order of their declaration."""
    hints, panel = get_type_hints(config), ""
    for f in fields(config):  # type: ignore[arg-type]  # every settings class is a dataclass
        hint = hints[f.name]
        variants = {v.kind: v for v in get_args(hint)} if isinstance(hint, UnionType) else {}
        values = get_args(hint) if get_origin(hint) is Literal else ()
        choices = {value: _choice(f.metadata["choices"].get(value, value.capitalize())) for value in values}
        of = _class_of_named(hint)
        kind = str if choices else Settings if variants else Named if of else hint
        said = {key: f.metadata[key] for key in ("doc", "limits", "soft", "unit", "when")}
        panel = f.metadata["panel"] or panel
        label = f.metadata["label"] or f.name.replace("_", " ").title()
        yield Entry(f.name, kind, f.default, label=label, choices=choices, variants=variants, of=of, panel=panel, **said)


def _choice(said: str | Choice) -> Choice:
    return said if isinstance(said, Choice) else Choice(said)


def _class_of_named(hint: Any) -> type[Settings] | None:
    """X if a type is Named[X], otherwise None."""
    of = get_args(hint)
    return get_args(of[0])[1] if of[1:] == (...,) else None


def _checked(entry: Entry, value: Any, path: str) -> Any:
    """Return the value in the field's own type, or raise SettingsError."""
    if entry.variants or entry.choices:
        fits = type(value) in entry.variants.values() or (isinstance(value, str) and value in entry.choices)
        if not fits:
            raise SettingsError(f"{path}={shown(value)} is not one of {', '.join([*entry.variants, *entry.choices])}")
        return value
    if entry.of:
        return _checked_names(entry, value, path)
    if entry.type is Path:
        return _checked_path(value, path)
    if entry.type == Pixel:
        if not isinstance(value, tuple | list) or len(value) != 2:
            raise SettingsError(f"{path}={shown(value)} is not a column and a row")
        return tuple(_checked_number(int, entry, part, path) for part in value)
    return _checked_number(entry.type, entry, value, path)


def _checked_names(entry: Entry, value: Any, path: str) -> tuple[tuple[str, Settings], ...]:
    if not isinstance(value, tuple) or not all(_is_named(item, entry.of) for item in value):
        raise SettingsError(f"{path}={shown(value)} is not a list of names and settings")
    names = [name for name, _ in value]
    for name in names:
        if fault := fault_of_name(name):
            raise SettingsError(f"{entry.label.lower()} {shown(name)} {fault}: rename it")
        if names.count(name) > 1:
            raise SettingsError(f"two {entry.name} are called {shown(name)}: rename one of them")
    return value


def _is_named(item: Any, of: type[Settings] | None) -> bool:
    return isinstance(item, tuple) and len(item) == 2 and isinstance(item[0], str) and type(item[1]) is of


def _checked_path(value: Any, path: str) -> Path:
    if not isinstance(value, str | Path) or "\0" in str(value):
        raise SettingsError(f"{path}={shown(value)} is not a path")
    return Path(value)


def _checked_number(kind: type, entry: Entry, value: Any, path: str) -> Any:
    """A bool, int or float within the limits of the entry."""
    if kind is float and type(value) is int:
        value = float(value) if abs(value) < LARGEST else math.inf
    if type(value) is not kind:
        raise SettingsError(f"{path}={shown(value)} is not of type {kind.__name__}")
    low, high = entry.limits
    outside = (low is not None and value < low) or (high is not None and value > high)
    if outside or (kind is float and not math.isfinite(value)):
        raise SettingsError(f"{path}={shown(value)} is out of range: must be {entry.range or 'finite'}")
    return value


def to_dict(config: Settings) -> dict[str, Any]:
    """Plain data for JSON. A variant becomes {"kind": its name, ...}; named settings become {name: {...}, ...}."""
    return {entry.name: _plain(entry, getattr(config, entry.name)) for entry in entries(type(config))}


def _plain(entry: Entry, value: Any) -> Any:
    if entry.variants:
        return {"kind": value.kind} | to_dict(value)
    if entry.of:
        return {name: to_dict(settings) for name, settings in value}
    if entry.type == Pixel:
        return list(value)
    return str(value) if entry.type is Path else value


def from_dict(config: type[SettingsType], values: Any) -> SettingsType:
    """Inverse of `to_dict`. Missing values keep their defaults; SettingsError on unknown names and bad values."""
    if not isinstance(values, Mapping):
        raise SettingsError(f"{config.kind}={shown(values)} is not a group of settings")
    known = {entry.name: entry for entry in entries(config)}
    kwargs = {}
    for name, value in values.items():
        if name not in known:
            raise SettingsError(f"{config.kind} has no setting {shown(name)}{hint(name, known)}")
        kwargs[name] = _read(known[name], value, f"{config.kind}.{name}")
    return config(**kwargs)


def from_file(config: type[SettingsType], path: Path, called: str) -> SettingsType:
    """Settings from a file of JSON. InputError if it cannot be read or has a fault, before which stands how it is `called`."""
    with trying_to(f"read {path}"):
        try:
            return from_dict(config, load(path))
        except (InputError, ValueError) as error:
            raise InputError(f"{called}: {error}") from error


def _read(entry: Entry, value: Any, path: str) -> Any:
    """Settings from the output of `_plain`; other values unchanged, because the class checks them."""
    if entry.variants:
        rest = dict(value) if isinstance(value, Mapping) else {"kind": value}
        return from_dict(variant_of(entry, rest.pop("kind", None), path), rest)
    if entry.of and isinstance(value, Mapping):
        return tuple((name, named(entry, name, from_dict, entry.of, settings)) for name, settings in value.items())
    return value


def named(entry: Entry, name: Any, make: Callable[..., Settings], *arguments: Any) -> Any:
    """Make the settings with this name. A SettingsError contains the name."""
    try:
        return make(*arguments)
    except SettingsError as error:
        raise SettingsError(f"{entry.label.lower()} {shown(name)}: {error}") from error


def variant_of(entry: Entry, kind: Any, path: str) -> type[Settings]:
    """The variant of that kind."""
    if not isinstance(kind, str) or kind not in entry.variants:
        raise SettingsError(f"{path}={shown(kind)} is not one of {', '.join(entry.variants)}{hint(kind, entry.variants)}")
    return entry.variants[kind]


def hint(name: Any, known: Iterable[str]) -> str:
    """A question that suggests the known name closest to a wrong name; empty if no name is close."""
    close = difflib.get_close_matches(str(name), list(known), n=1)
    return f"; did you mean {close[0]!r}?" if close else ""
