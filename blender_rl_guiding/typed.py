"""Reads JSON into values of annotated types. All JSON that may come from strangers is read here.

Standard library only: Blender's own Python (3.11 or newer) imports this to write bundles.
"""

import json
import math
import os
import reprlib
import stat
from collections.abc import Callable, Collection, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from io import BufferedReader
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from .memory import available
from .strings import one_line, printable


class MalformedError(ValueError):
    """A value of the wrong type. The message is one line that names the value."""

    def __init__(self, text: str) -> None:
        super().__init__(printable(text))


@dataclass(frozen=True)
class Range:
    """Inclusive limits of a number, as in `Annotated[int, Range(0, 64)]`. NaN is outside of all limits."""

    low: float
    high: float


@dataclass(frozen=True)
class Length:
    """The number of values in a tuple, as in `Annotated[tuple[int, ...], Length(4)]`."""

    count: int


WHOLE = Range(-(2**63), 2**63 - 1)  # default limits of whole numbers, which are the limits of arrays


LARGEST = 1 << 26  # maximal bytes of a JSON file
PARSED = 100  # maximal bytes in Python per byte of JSON; the worst case is "[[],[]]"
DEEPEST = 32  # maximal nesting of lists and objects, for values of type Any


_NUMBER = int | float


def load(path: Path) -> Any:
    """Parse a JSON file. OSError if it cannot be read, MalformedError if it is not JSON."""
    with opened(path) as file:
        text = file.read(LARGEST + 1)
    if len(text) > LARGEST or PARSED * len(text) > available():
        raise MalformedError(f"{len(text)} bytes are too many")
    return parse(text)


def opened(path: Path) -> BufferedReader:
    """Open a file that may come from a stranger. OSError if it cannot be opened, or if it is a pipe or a device, because these may never
    end.
    """
    file = open(path, "rb", opener=_without_waiting)  # noqa: SIM115  # the caller's to close
    if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        return file
    file.close()
    raise OSError("it is not a file")


def _without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))  # otherwise opening a pipe blocks until another process writes to it


def parse(text: str | bytes) -> Any:
    """Parse JSON. MalformedError if it is not JSON, or too deeply nested."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MalformedError(f"not JSON ({one_line(error)})") from error


def read(kind: Any, value: Any, name: str, *, loose: bool = False) -> Any:
    """The value as the annotated type `kind`, called `name` in errors; MalformedError if it is of another type.

    Kinds are bool, int, float, str, None, Any, Literal, dataclasses (objects in JSON), tuples (lists), dict with names of type str, unions
    of these, and Annotated with a `Range`, a `Length` or a function that returns a value's fault. The JSON type of the value chooses the
    member of a union. With `loose`, fields with a default may be missing, and unknown names are ignored, because the file may come from
    another version.
    """
    if get_origin(kind) is Annotated:
        kind, limits = get_args(kind)
        made = read(kind, value, name, loose=loose)
        check: Any = _within if isinstance(limits, Range) else _long if isinstance(limits, Length) else _without_fault
        return check(limits, made, name)
    if kind is Any:
        return _anything(value, name, DEEPEST)
    if get_origin(kind) in (UnionType, Union):  # the latter where a member is Annotated
        return read(_member(kind, value, name), value, name, loose=loose)
    if get_origin(kind) is Literal:
        if value not in get_args(kind) or isinstance(value, bool):
            raise MalformedError(f"{name} is {shown(value)}, not one of {', '.join(map(str, get_args(kind)))}")
        return value
    if isinstance(kind, type) and is_dataclass(kind):
        return _fields(kind, value, name, loose)
    if get_origin(kind) is tuple:
        return _items(get_args(kind), value, name, loose)
    if get_origin(kind) is dict:
        names, of = get_args(kind)
        given = _typed(dict, value, name)
        if names is str and _all_fit(of, given.values()) and "".join(given).isascii():
            return given
        return {read(names, key, name): read(of, part, f"{name}.{key}", loose=loose) for key, part in given.items()}
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
        raise MalformedError(f"{name} has {shown(unknown[0])}, which is none of its fields")
    optional = {f.name for f in known.values() if loose and (f.default, f.default_factory) != (MISSING, MISSING)}
    if missing := [key for key in known if key not in given and key not in optional]:
        raise MalformedError(f"{name} lacks {missing[0]!r}")
    return kind(**{key: read(hints[key], part, f"{name}.{key}", loose=loose) for key, part in given.items() if key in known})


@cache
def _hints(kind: type) -> dict[str, Any]:
    """The types of a dataclass's fields, with their annotations."""
    return get_type_hints(kind, include_extras=True)


def _items(kinds: Sequence[Any], value: Any, name: str, loose: bool) -> tuple[Any, ...]:
    given = _typed(list, value, name)
    if kinds[1:] == (...,):
        if _all_fit(kinds[0], given):
            return tuple(given)
        kinds = [kinds[0]] * len(given)
    if len(given) != len(kinds):
        raise MalformedError(f"{name} has {len(given)} values, not {len(kinds)}")
    return tuple(read(kind, part, f"{name}[{k}]", loose=loose) for k, (kind, part) in enumerate(zip(kinds, given, strict=True)))


def _all_fit(kind: Any, values: Collection[Any]) -> bool:
    """Whether all values are already numbers of this kind. A fast path: there may be millions, and `read` takes ten microseconds for
    each.
    """
    kind, limits = get_args(kind) if get_origin(kind) is Annotated else (kind, None)
    types = set(map(type, values))
    if kind == _NUMBER:
        return types <= {int, float} and all(type(value) is float or WHOLE.low <= value <= WHOLE.high for value in values)
    if kind is not float or types - {float}:
        return False
    return limits is None or (isinstance(limits, Range) and all(limits.low <= value <= limits.high for value in values))


def _anything(value: Any, name: str, deep: int) -> Any:
    """The value unchanged. MalformedError if it cannot be shown or written again."""
    if not deep:
        raise MalformedError(f"{name} is nested too deeply")
    if isinstance(value, dict):
        return {_text(key, name): _anything(part, f"{name}.{key}", deep - 1) for key, part in value.items()}
    if isinstance(value, list):
        return [_anything(part, f"{name}[{k}]", deep - 1) for k, part in enumerate(value)]
    return _text(value, name) if isinstance(value, str) else value


def _member(union: Any, value: Any, name: str) -> Any:
    """The member of a union that fits the JSON type of a value. `read` checks its limits."""
    for kind in get_args(union):
        bare = get_args(kind)[0] if get_origin(kind) is Annotated else kind
        if _fits(bare, value):
            return kind
    raise MalformedError(f"{name} cannot be {shown(value)}")


def _fits(kind: Any, value: Any) -> bool:
    """Whether the JSON type of a value fits a kind."""
    if isinstance(value, dict):
        return is_dataclass(kind) or get_origin(kind) is dict
    if isinstance(value, list):
        return get_origin(kind) is tuple
    return kind is type(value) or (kind is float and type(value) is int)


def _typed(kind: Any, value: Any, name: str) -> Any:
    kind = NoneType if kind is None else kind
    if type(value) is not kind:
        raise MalformedError(f"{name} is {shown(value)}, not of type {kind.__name__}")
    return value


def _number(value: Any, name: str) -> float:
    if type(value) is int:
        try:
            return float(value)
        except OverflowError as error:
            raise MalformedError(f"{name} is {shown(value)}, which is too large") from error
    return _typed(float, value, name)


def _text(value: Any, name: str) -> str:
    try:
        _typed(str, value, name).encode()
    except UnicodeEncodeError as error:  # half of a character (a surrogate), which can be neither shown nor written
        raise MalformedError(f"{name} is {shown(value)}, which is no text") from error
    return value


def _within(limits: Range, value: Any, name: str) -> Any:
    if isinstance(value, float) and not math.isfinite(value) and not limits.low <= value <= limits.high:
        raise MalformedError(f"{name} is {value}, which is not a finite number")
    if not limits.low <= value <= limits.high:
        raise MalformedError(f"{name} is {shown(value)}, not within {limits.low} and {limits.high}")
    return value


def _without_fault(find: Callable[[Any], str], value: Any, name: str) -> Any:
    if fault := find(value):
        raise MalformedError(f"{name} is {shown(value)}, which {fault}")
    return value


def _long(wanted: Length, value: Any, name: str) -> Any:
    if len(value) != wanted.count:
        raise MalformedError(f"{name} has {len(value)} values, not {wanted.count}")
    return value


_SHORT = reprlib.Repr()
_SHORT.maxlevel, _SHORT.maxstring, _SHORT.maxlong, _SHORT.maxother = 3, 60, 60, 60


def shown(value: Any) -> str:
    """A short text for any value."""
    try:
        text = _SHORT.repr(value).encode("ascii", "backslashreplace").decode()
    except (ValueError, RecursionError):  # a number with thousands of digits, or thousands of nested lists
        return f"a {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."
