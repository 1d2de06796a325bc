"""Values of annotated types, made of what JSON has of them. Whatever is read from a file that anyone may have written goes through here.

Standard library only: bundles are written by Blender's own Python (3.11 or newer), which imports this with them.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints


class MalformedError(ValueError):
    """A value that is not of its type; the message is one line that names it."""


@dataclass(frozen=True)
class Range:
    """Inclusive limits of a number, as `Annotated[int, Range(0, 64)]`. NaN is within none."""

    low: float
    high: float


@dataclass(frozen=True)
class Length:
    """How many values a tuple has, as `Annotated[tuple[int, ...], Length(4)]`."""

    count: int


WHOLE = Range(-(2**63), 2**63 - 1)  # of whole numbers that have no limits of their own: what arrays can hold


def parse(text: str | bytes) -> Any:
    """What JSON says. MalformedError where it is none, or nested too deeply to be any of ours."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MalformedError(f"not JSON ({_one_line(error)})") from error


def read(kind: Any, value: Any, name: str, *, loose: bool = False) -> Any:
    """A value of the annotated type `kind`, called `name` in errors; MalformedError if it is something else.

    Kinds are bool, int, float, str, None, Literal, Annotated with a `Range` or a `Length`, dataclasses as objects, tuples as lists, dict
    with names of type str, Any, and unions of these, of which JSON's own types choose. With `loose`, fields that have a default may be
    missing, and names that a dataclass does not have are passed over: the file may be of another version.
    """
    if get_origin(kind) is Annotated:
        kind, limits = get_args(kind)
        made = read(kind, value, name, loose=loose)
        return _long(limits, made, name) if isinstance(limits, Length) else _within(limits, made, name)
    if kind is Any:
        return value
    if isinstance(kind, UnionType) or get_origin(kind) is Union:  # of which Annotated makes the second
        return read(_member(kind, value, name), value, name, loose=loose)
    if get_origin(kind) is Literal:
        if value not in get_args(kind) or isinstance(value, bool):
            raise MalformedError(f"{name} is {_shown(value)}, not one of {', '.join(map(str, get_args(kind)))}")
        return value
    if isinstance(kind, type) and is_dataclass(kind):
        return _fields(kind, value, name, loose)
    if get_origin(kind) is tuple:
        return _items(get_args(kind), value, name, loose)
    if get_origin(kind) is dict:
        of = get_args(kind)[1]
        return {_text(key, name): read(of, part, f"{name}.{key}", loose=loose) for key, part in _typed(dict, value, name).items()}
    if kind is str:
        return _text(value, name)
    if kind is float:
        return _number(value, name)
    if kind is int:
        return _within(WHOLE, _typed(int, value, name), name)
    return _typed(kind, value, name)


def _fields(kind: Any, value: Any, name: str, loose: bool) -> Any:
    hints, known = _hints(kind), {f.name: f for f in fields(kind)}
    given = _typed(dict, value, name)
    if unknown := [key for key in given if key not in known and not loose]:
        raise MalformedError(f"{name} has {_shown(unknown[0])}, which is nothing of it")
    optional = {f.name for f in known.values() if loose and (f.default, f.default_factory) != (MISSING, MISSING)}
    if missing := [key for key in known if key not in given and key not in optional]:
        raise MalformedError(f"{name} lacks {missing[0]!r}")
    return kind(**{key: read(hints[key], part, f"{name}.{key}", loose=loose) for key, part in given.items() if key in known})


@cache
def _hints(kind: type) -> dict[str, Any]:
    """The types of a dataclass's fields, with what is annotated."""
    return get_type_hints(kind, include_extras=True)


def _items(kinds: Sequence[Any], value: Any, name: str, loose: bool) -> tuple[Any, ...]:
    given = _typed(list, value, name)
    if kinds[1:] == (...,):
        kinds = [kinds[0]] * len(given)
    if len(given) != len(kinds):
        raise MalformedError(f"{name} has {len(given)} values, not {len(kinds)}")
    return tuple(read(kind, part, f"{name}[{k}]", loose=loose) for k, (kind, part) in enumerate(zip(kinds, given, strict=True)))


def _member(union: Any, value: Any, name: str) -> Any:
    """The member of a union that what JSON has can be meant for."""
    wanted = {dict: lambda k: is_dataclass(k) or get_origin(k) is dict, list: lambda k: get_origin(k) is tuple}
    for kind in get_args(union):
        bare = get_args(kind)[0] if get_origin(kind) is Annotated else kind  # the limits are `read`'s to check
        fits = wanted.get(
            type(value), lambda k: k is type(value) or (k is float and type(value) is int) or (k is NoneType and value is None)
        )
        if fits(bare):
            return kind
    raise MalformedError(f"{name} is {_shown(value)}, which it cannot be")


def _typed(kind: Any, value: Any, name: str) -> Any:
    kind = NoneType if kind is None else kind
    if type(value) is not kind:
        raise MalformedError(f"{name} is {_shown(value)}, not of type {kind.__name__}")
    return value


def _number(value: Any, name: str) -> float:
    if type(value) is int:
        try:
            return float(value)
        except OverflowError as error:
            raise MalformedError(f"{name} is {_shown(value)}, which is too large") from error
    return _typed(float, value, name)


def _text(value: Any, name: str) -> str:
    try:
        _typed(str, value, name).encode()
    except UnicodeEncodeError as error:  # half of a character: it could neither be shown nor written
        raise MalformedError(f"{name} is {_shown(value)}, which is no text") from error
    return value


def _within(limits: Range, value: Any, name: str) -> Any:
    if isinstance(value, float) and not math.isfinite(value) and not limits.low <= value <= limits.high:
        raise MalformedError(f"{name} is {value}, which is not a finite number")
    if not limits.low <= value <= limits.high:
        raise MalformedError(f"{name} is {_shown(value)}, not within {limits.low} and {limits.high}")
    return value


def _long(wanted: Length, value: Any, name: str) -> Any:
    if len(value) != wanted.count:
        raise MalformedError(f"{name} has {len(value)} values, not {wanted.count}")
    return value


def _shown(value: Any) -> str:
    """A value in a few words, whatever it is."""
    try:
        text = ascii(value)
    except (ValueError, RecursionError):  # a number of thousands of digits
        return f"a {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__
