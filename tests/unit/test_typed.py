"""Values of annotated types are read from JSON of unknown origin."""

import json
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest

from blender_rl_guiding import typed
from blender_rl_guiding.typed import Length, MalformedError, Range, load, parse, read


@dataclass(frozen=True)
class Part:
    index: Annotated[int, Range(0, 9)]


@dataclass(frozen=True)
class Whole:
    name: str
    mode: Literal["a", "b"]
    share: Annotated[float, Range(0, 1)]
    parts: tuple[Part, ...]
    corner: tuple[float, float]
    value: float | tuple[float, float] | Part | None
    name_or_none: Annotated[str, lambda name: "is short" if len(name) < 3 else ""] | None
    by_name: dict[str, int]
    free: Any = None


GOOD: dict[str, Any] = {
    "name": "é",
    "mode": "a",
    "share": 1,
    "parts": [{"index": 0}],
    "corner": [1, 2.5],
    "value": {"index": 3},
    "name_or_none": "abc",
    "by_name": {"x": 2**62},
    "free": [None],
}


def test_good_values_are_taken():
    made = read(Whole, GOOD, "whole")
    assert made == Whole("é", "a", 1.0, (Part(0),), (1.0, 2.5), Part(3), "abc", {"x": 2**62}, [None])
    assert type(made.share) is float
    assert [read(Whole, GOOD | {"value": v}, "whole").value for v in (1, [1, 2], None)] == [1.0, (1.0, 2.0), None]


BAD = {
    "name": [3, None, "\ud800", ["a"]],
    "mode": ["c", 0, True, None, ["a"]],
    "share": [-0.1, 1.1, math.nan, math.inf, 10**400, "1", True, None],
    "parts": [[{"index": 10}], [{"index": 10**40}], [{"index": 0.0}], [{}], [{"index": 1, "more": 2}], {}, [3], None, "ab"],
    "corner": [[1], [1, 2, 3], [1, None], 1, {"0": 1}],
    "value": ["a", [1], True, {"index": -1}, {"x": 1}],
    "name_or_none": ["ab", 3],
    "free": ["\ud800", {"\ud800": 1}, [[{"a": ["\udfff"]}]], json.loads("[" * 40 + "]" * 40)],
    "by_name": [[], {"x": 2**63}, {"x": 1.0}, {"\udfff": 1}],
}


@pytest.mark.parametrize(("field", "value"), [(field, value) for field, values in BAD.items() for value in values])
def test_bad_values_are_named(field, value):
    with pytest.raises(MalformedError, match=rf"^whole\.{field}") as info:
        read(Whole, GOOD | {field: value}, "whole")
    assert "\n" not in str(info.value)
    str(info.value).encode()  # it can be printed


def test_strict_and_loose():
    short = {name: value for name, value in GOOD.items() if name != "free"}
    assert read(Whole, short | {"new": 1}, "whole", loose=True).free is None
    for bad in (short, GOOD | {"new": 1}):
        with pytest.raises(MalformedError):
            read(Whole, bad, "whole")
    with pytest.raises(MalformedError, match="lacks 'mode'"):
        read(Whole, {name: value for name, value in GOOD.items() if name != "mode"}, "whole", loose=True)


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, "1" * 10_000, b"\xff", "nul"], ids=range(6))
def test_what_is_no_json_is_one_line(text):
    with pytest.raises(MalformedError, match=r"^not JSON") as info:
        parse(text)
    assert "\n" not in str(info.value)


def test_long_lists_of_numbers_are_checked_as_short_ones_are():
    kind = tuple[Annotated[float, Range(0, 1)], ...]
    assert read(kind, [0.5, 1.0, 0.0], "n") == (0.5, 1.0, 0.0)
    assert [type(number) for number in read(kind, [0.5, 1], "n")] == [float, float]
    assert math.isnan(read(tuple[float, ...], [math.nan], "n")[0])
    for bad in (math.nan, math.inf, -0.1, "1", None, True):
        with pytest.raises(MalformedError, match=r"^n\[1\] is"):
            read(kind, [0.5, bad], "n")


def test_plain_numbers_by_name_are_checked_alike():
    kind = dict[str, int | float]
    assert read(kind, {"a": 1, "b": 0.5}, "n") == {"a": 1, "b": 0.5}
    for bad in ({"a": True}, {"a": 2**63}, {"a": None}, {"a": "1"}, {"\ud800": 1}):
        with pytest.raises(MalformedError, match=r"^n"):
            read(kind, bad, "n")


def test_a_file_of_json_is_a_file_and_not_without_end(tmp_path, monkeypatch):
    path = tmp_path / "a.json"
    path.write_text('{"a": [1]}')
    assert load(path) == {"a": [1]}
    monkeypatch.setattr(typed, "LARGEST", 9)
    with pytest.raises(MalformedError, match="10 bytes are too many"):
        load(path)
    os.mkfifo(tmp_path / "pipe")
    for endless in (Path("/dev/zero"), tmp_path / "pipe"):
        with pytest.raises(OSError, match="not a file"):
            load(endless)
    with pytest.raises(OSError, match="directory"):
        load(tmp_path)


def test_lengths_and_limits_within_unions():
    share = Annotated[float, Range(0.0, 1.0)]
    row = Annotated[tuple[share, ...], Length(2)]
    assert read(share | row, 1, "x") == 1.0
    assert read(share | row, [0.0, 1.0], "x") == (0.0, 1.0)
    for bad, said in (
        (1.5, "x is 1.5, not within"),
        ([0.5], "x has 1 values, not 2"),
        ([0.5, math.nan], r"x\[1\] is nan"),
        ("a", "cannot be"),
    ):
        with pytest.raises(MalformedError, match=said):
            read(share | row, list(bad) if isinstance(bad, tuple) else bad, "x")
