"""Damage to what is read: every value of a JSON text replaced by the extremes of each type, and every file of a folder by no file.

All of it comes in the same order each time; `some` takes a fair part of it by a seed.
"""

import json
import random
import shutil
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

_T = TypeVar("_T")
_MARK = "@here@"
# As JSON has them, or as Python's own reader takes them. What JSON cannot say is the text of a number that no type of ours holds.
EXTREMES = (
    *("null", "true", "false", "0", "-1", "1", "3", "-0.0", "0.5", "1e-320", "1e-300", "1e300", "1e308", "-1e308", "1e999"),
    *("NaN", "Infinity", "-Infinity", str(2**31), str(2**53 + 1), str(2**63 - 1), str(2**63), str(-(2**63) - 1), str(10**30), "1" * 5000),
    *('""', '"x"', '"a/../../../x"', '".."', '"/etc/x"', '"\\u001b[31mred"', '"a\\nb"', '"\\u0000"', '"\\ud800"', '"\\u202e"', '"con:"'),
    *('"{{body}}"', '"=1+1"', '"[red]x[/]"', '"<script>x</script>"', '"$x^$"', '"' + "a" * 5000 + '"', '"' + "é" * 200 + '"'),
    *("[]", "[[]]", "[null]", "[1, 2]", '["x", "x"]', "[" + "0, " * 3000 + "0]", "[" * 990 + "]" * 990, "[" * 50_000 + "]" * 50_000),
    *("{}", '{"": 0}', '{"a": 1}', '{"kind": "x"}', '{"a":' * 990 + "0" + "}" * 990),
)


def of_json(text: str) -> Iterator[tuple[str, str]]:
    """(description, text) for each value of the JSON: replaced by each extreme, removed, and doubled in its list."""
    for path in _paths(json.loads(text)):
        marked = json.dumps(_changed(json.loads(text), path, _MARK))
        for extreme in EXTREMES:
            yield f"{_shown(path)} is {extreme[:40]}", marked.replace(f'"{_MARK}"', extreme, 1)
        if path:
            yield f"{_shown(path)} is gone", json.dumps(_without(json.loads(text), path))
            yield f"{_shown(path)} is there twice", json.dumps(_doubled(json.loads(text), path))


def _paths(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where values are; of a long list the first two and the last."""
    yield path
    if isinstance(value, dict):
        for key, part in value.items():
            yield from _paths(part, (*path, key))
    if isinstance(value, list):
        for k in sorted({0, 1, len(value) - 1} & {*range(len(value))}):
            yield from _paths(value[k], (*path, k))


def _shown(path: tuple[Any, ...]) -> str:
    return ".".join(map(str, path)) or "everything"


def _changed(value: Any, path: tuple[Any, ...], new: Any) -> Any:
    if not path:
        return new
    _at(value, path[:-1])[path[-1]] = new
    return value


def _without(value: Any, path: tuple[Any, ...]) -> Any:
    del _at(value, path[:-1])[path[-1]]
    return value


def _doubled(value: Any, path: tuple[Any, ...]) -> Any:
    holder = _at(value, path[:-1])
    if isinstance(holder, list):
        holder.insert(path[-1], holder[path[-1]])
    else:
        holder[f"{path[-1]} "] = holder[path[-1]]
    return value


def _at(value: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        value = value[key]
    return value


def of_bytes(data: bytes, seed: int, count: int) -> Iterator[tuple[str, bytes]]:
    """What was done, and the bytes that it made: none, cut short, doubled, one bit turned, a stretch overwritten; `count` of each."""
    yield "empty", b""
    yield "twice", data * 2
    rng = random.Random(seed)
    for _ in range(count):
        place, length = rng.randrange(len(data)), rng.randrange(1, 64)
        before, behind = data[:place], data[place + length :]
        yield f"cut at {place}", before
        yield f"bit turned at {place}", before + bytes([data[place] ^ 1 << rng.randrange(8)]) + data[place + 1 :]
        yield f"noise at {place}", (before + rng.randbytes(length) + behind)[: len(data)]
        if any(data[place : place + length]):
            yield f"zeros at {place}", (before + bytes(length) + behind)[: len(data)]
        yield f"stretch at {place} gone", before + behind


def of_files(folder: Path) -> Iterator[tuple[str, Callable[[Path], object]]]:
    """What is done, and how to do it to a copy of the folder: each file or folder gone, or a link, the other kind, or another file."""
    places = sorted(path.relative_to(folder) for path in folder.rglob("*"))
    files = [place for place in places if (folder / place).is_file()]
    for place in places:
        yield f"{place} is gone", lambda copy, place=place: _remove(copy / place)
        yield f"{place} links to nowhere", lambda copy, place=place: _link(copy / place, Path("nowhere"))
        yield f"{place} links to itself", lambda copy, place=place: _link(copy / place, Path(place.name))
        yield f"{place} links out", lambda copy, place=place: _link(copy / place, (folder / place).absolute())
        yield f"{place} is the other kind", lambda copy, place=place: _other_kind(copy / place)
    for place, other in zip(files, files[1:] + files[:1], strict=True):
        yield f"{place} is {other}", lambda copy, place=place, other=other: shutil.copy(folder / other, copy / place)


def _remove(path: Path) -> None:
    shutil.rmtree(path) if path.is_dir() else path.unlink()


def _link(path: Path, target: Path) -> None:
    _remove(path)
    path.symlink_to(target)


def _other_kind(path: Path) -> None:
    was_file = path.is_file()
    _remove(path)
    path.mkdir() if was_file else path.write_bytes(b"x")


@contextmanager
def named(what: str) -> Iterator[None]:
    """Have a failure of the block say what was done."""
    try:
        yield
    except Exception as error:
        error.add_note(what)
        raise


def some(mutations: Iterable[_T], count: int, seed: int) -> list[_T]:
    """So many of them, from anywhere, in their order; all where there are not more."""
    found = list(mutations)
    chosen = sorted(random.Random(seed).sample(range(len(found)), min(count, len(found))))
    return [found[k] for k in chosen]
