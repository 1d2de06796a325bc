"""Damage to what is read from files: JSON, bytes and folders. `npz` has that to arrays and zips.

`of_json`, `of_bytes` and `of_files` list damage in a fixed order. The others draw one by a generator: the same seed does it again.
"""

import copy
import json
import random
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

_T = TypeVar("_T")
# JSON that `json.dumps` writes for no value. `as_json` puts it in the place of a text.
RAW = {
    "@deep@": "[" * 100_000 + "]" * 100_000,
    "@nested@": "[" * 990 + "]" * 990,
    "@objects@": '{"a":' * 990 + "0" + "}" * 990,
    "@digits@": "9" * 5000,
    "@infinite@": "1e999",
}
LARGEST, SMALLEST = 1.7976931348623157e308, 5e-324  # finite, float64
NUMBERS = (
    *(0, 1, -1, 2, 3, 255, 256, 65535, 65536, 2**31 - 1, 2**31, -(2**31), 2**32, 2**53 + 1),
    *(2**63 - 1, 2**63, -(2**63), -(2**63) - 1, 2**64, 10**30),
    *(-0.0, 0.5, -0.5, 1.0000001, 1e-9, 1e9, 1e30, -1e30, 3.5e38, 1e-300, 1e300, -1e308, LARGEST, SMALLEST),
    *(float("nan"), float("inf"), float("-inf")),
)
TEXTS = (
    *("", " ", ".", "..", "a/b", "../../canary.txt", "../../../canary", "a/../../../../x", "/nowhere/x", "\x00", "a\x00b", "\n", "\r"),
    *("two\nlines", "\x1b[31mred\x1b[0m", "\ud800", "\udfff", "\u202e", "é" * 200, "x", "x" * 300, "x" * 5000, "💥"),
    *("NaN", "null", "1", "-1", "{{body}}", "{{title}}", "<script>alert(1)</script>", "</script>", "&amp;", "=1+1", "=cmd|' /C calc'!A0"),
    *("\\input{/etc/passwd}", "%s%n", "$x$", "$x^$", "$\\frac{1$", "$\\nonsense$", "x_y^", "$", "$$"),
    *("CON", "con:", "nul.", "-rf", "~", "$HOME", "%TEMP%", "*", "[red]x[/]", *RAW),
)
OTHERS = (
    *(None, True, False, [], {}, [[]], [None], [1, 2], [1, 2, 3], ["x", "x"], [0] * 3000, [[1.0] * 4] * 4, [[0.0] * 4] * 3),
    *({"": None}, {"": 0}, {"a": 1}, {"kind": "x"}, {"kind": "dqn"}),
)
EXTREMES = (*OTHERS, *NUMBERS, *TEXTS)


# ---------------------------------------------------------------------------------------------------------------- JSON


def of_json(text: str) -> Iterator[tuple[str, str]]:
    """(description, JSON) for each value: replaced by each of EXTREMES, gone, and doubled. Of lists the first two and the last."""
    for place in places(json.loads(text), few=True):
        shown = ".".join(map(str, place)) or "everything"
        for value in EXTREMES:
            yield f"{shown} is {as_json(value)[:40]}", as_json(_replaced(json.loads(text), place, value))
        if place:
            yield f"{shown} is gone", as_json(_without(json.loads(text), place))
            yield f"{shown} is there twice", as_json(_doubled(json.loads(text), place))


def as_json(value: Any) -> str:
    """JSON of plain data, with RAW put in."""
    said = json.dumps(value)
    for name, raw in RAW.items():
        said = said.replace(f'"{name}"', raw)
    return said


def places(value: Any, above: tuple[Any, ...] = (), few: bool = False) -> Iterator[tuple[Any, ...]]:
    """The keys that lead to each part of plain data, itself first. `few`: of a list the first two and the last."""
    yield above
    for key, part in _parts(value, few):
        yield from places(part, (*above, key), few)


def _parts(value: Any, few: bool) -> list[tuple[Any, Any]]:
    if isinstance(value, dict):
        return [*value.items()]
    if not isinstance(value, list):
        return []
    wanted = {0, 1, len(value) - 1} if few else range(len(value))
    return [(k, part) for k, part in enumerate(value) if k in wanted]


def at(value: Any, place: Sequence[Any]) -> Any:
    """The part of plain data at a place."""
    for key in place:
        value = value[key]
    return value


def _replaced(value: Any, place: Sequence[Any], new: Any) -> Any:
    if not place:
        return new
    at(value, place[:-1])[place[-1]] = new
    return value


def _without(value: Any, place: Sequence[Any]) -> Any:
    del at(value, place[:-1])[place[-1]]
    return value


def _doubled(value: Any, place: Sequence[Any], times: int = 1) -> Any:
    holder, key = at(value, place[:-1]), place[-1]
    if isinstance(holder, list):
        holder[key:key] = [copy.deepcopy(holder[key])] * times
    else:
        holder[f"{key} "] = copy.deepcopy(holder[key])
    return value


def damaged(value: Any, rng: random.Random, texts: Sequence[str] = TEXTS, times: int | None = None) -> Any:
    """Plain data with one to three parts replaced, gone, doubled, exchanged, nested or renamed; new texts are of `texts`."""
    new = json.loads(json.dumps(value))
    for _ in range(times or rng.choice((1, 1, 1, 2, 3))):
        new = _damaged_once(new, rng, texts)
    return new


def _damaged_once(value: Any, rng: random.Random, texts: Sequence[str]) -> Any:
    there = list(places(value))
    place = rng.choice(there)
    if not place:
        return value if rng.random() < 0.9 else extreme(None, rng, texts)
    holder, key = at(value, place[:-1]), place[-1]
    match rng.choice(("other", "other", "other", "near", "near", "delete", "twice", "exchange", "nest", "name")):
        case "other":
            return _replaced(value, place, extreme(holder[key], rng, texts))
        case "near":
            return _replaced(value, place, near(holder[key], rng, texts))
        case "delete":
            return _without(value, place)
        case "twice":
            return _doubled(value, place, rng.choice((1, 2, 100)))
        case "exchange":
            return _replaced(value, place, copy.deepcopy(at(value, rng.choice(there))))
        case "nest":
            return _replaced(value, place, rng.choice(([holder[key]], {"kind": holder[key]}, [[holder[key]] * 2])))
        case _ if isinstance(holder, dict):
            holder[rng.choice((*texts, f"{key}s", str(key).upper()))] = holder.pop(key)
    return value


def extreme(value: Any, rng: random.Random, texts: Sequence[str] = TEXTS) -> Any:
    """A value to put in the place of another: mostly of its type, as the program notices other types at once."""
    own: Sequence[Any] = OTHERS
    if isinstance(value, str):
        own = texts
    elif isinstance(value, int | float):
        own = NUMBERS
    return copy.deepcopy(rng.choice(own if rng.random() < 0.7 else (*NUMBERS, *texts, *OTHERS)))


def near(value: Any, rng: random.Random, texts: Sequence[str] = TEXTS) -> Any:
    """A value that could nearly be right."""
    if isinstance(value, bool) or value is None:
        return not value
    if isinstance(value, int | float):
        return rng.choice((-value, value + 1, value - 1, value * 2, value / 2, value * 1e6, value * 1e-6, float(value), str(value)))
    if isinstance(value, str):
        return rng.choice((value + rng.choice(texts), value[:-1], value.upper(), value * 2, f"{value}/../{value}"))
    if isinstance(value, list):
        return rng.choice((value[1:], value[:-1], value * 2, value[::-1], sorted(value, key=str)))
    return {key: part for key, part in value.items() if rng.random() < 0.8}


def text(value: Any, rng: random.Random) -> str:
    """JSON of damaged data; one in ten is damaged as a text, too."""
    said = as_json(value)
    if rng.random() < 0.9 or not said:
        return said
    middle = rng.randrange(len(said))
    return rng.choice(
        (
            said[:middle],
            said[:middle] + rng.choice('{}[]",:0e\\\x00\ufeff') + said[middle + 1 :],
            said.replace('":', '":0,"', 1),
            "\ufeff" + said,
            said + said,
            said.replace("{", '{"twice": 1, "twice": 2, ', 1),
        )
    )


# --------------------------------------------------------------------------------------------------------------- bytes


def of_bytes(data: bytes, seed: int, count: int) -> Iterator[tuple[str, bytes]]:
    """(description, bytes): none, all of it twice, and `count` times one of each way at a place of its own."""
    yield "empty", b""
    yield "twice", data * 2
    rng = random.Random(seed)
    for _ in range(count):
        yield from _at_a_place(data, rng)


def _at_a_place(data: bytes, rng: random.Random) -> Iterator[tuple[str, bytes]]:
    place, length = rng.randrange(len(data)), rng.randrange(1, 64)
    before, behind = data[:place], data[place + length :]
    yield f"cut at {place}", before
    yield f"bit turned at {place}", before + bytes([data[place] ^ 1 << rng.randrange(8)]) + data[place + 1 :]
    yield f"noise at {place}", (before + rng.randbytes(length) + behind)[: len(data)]
    if any(data[place : place + length]):
        yield f"zeros at {place}", (before + bytes(length) + behind)[: len(data)]
    yield f"stretch at {place} gone", before + behind


def damaged_bytes(data: bytes, rng: random.Random) -> bytes:
    """Bytes with bits turned, or a part cut off, emptied, doubled, exchanged or put in; or damaged in a way of `of_bytes`."""
    new = bytearray(data)
    a, b = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    match rng.choice(("small", "small", "bits", "bits", "cut", "zero", "double", "exchange", "put", "head")):
        case "small" if data:
            return rng.choice([made for _, made in _at_a_place(data, rng)])
        case "bits" if data:
            for _ in range(rng.choice((1, 4, 64))):
                new[rng.randrange(len(new))] ^= 1 << rng.randrange(8)
        case "cut":
            del new[a:]
        case "zero":
            new[a:b] = bytes(b - a)
        case "double":
            new[a:a] = new[a : a + 64]
        case "exchange":
            new[a:] = new[b:] + new[a:b]
        case "put":
            new[a:a] = rng.randbytes(rng.choice((1, 8, 1000)))
        case _:
            new[: rng.choice((0, 4, len(new)))] = b""
    return bytes(new)


# ------------------------------------------------------------------------------------------------------------- folders


def of_files(folder: Path) -> Iterator[tuple[str, Callable[[Path], object]]]:
    """(description, function that damages a copy of the folder): each file or folder gone, a link, the other kind, or another file."""
    paths = sorted(path.relative_to(folder) for path in folder.rglob("*"))
    files = [path for path in paths if (folder / path).is_file()]
    for path in paths:
        yield f"{path} is gone", lambda copy, path=path: _remove(copy / path)
        yield f"{path} links to nowhere", lambda copy, path=path: _link(copy / path, Path("nowhere"))
        yield f"{path} links to itself", lambda copy, path=path: _link(copy / path, Path(path.name))
        yield f"{path} links out", lambda copy, path=path: _link(copy / path, (folder / path).absolute())
        yield f"{path} is the other kind", lambda copy, path=path: _other_kind(copy / path)
    for path, other in zip(files, files[1:] + files[:1], strict=True):
        yield f"{path} is {other}", lambda copy, path=path, other=other: shutil.copy(folder / other, copy / path)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink()


def _link(path: Path, target: Path) -> None:
    _remove(path)
    path.symlink_to(target)


def _other_kind(path: Path) -> None:
    was_file = path.is_file()
    _remove(path)
    if was_file:
        path.mkdir()
    else:
        path.write_bytes(b"x")


# ----------------------------------------------------------------------------------------------------------- for tests


@contextmanager
def named(what: str) -> Iterator[None]:
    """A failure of the block says what was done."""
    try:
        yield
    except Exception as error:
        error.add_note(what)
        raise


def some(mutations: Iterable[_T], count: int, seed: int) -> list[_T]:
    """`count` of them, drawn by the seed, in their order; all if there are fewer."""
    found = list(mutations)
    chosen = sorted(random.Random(seed).sample(range(len(found)), min(count, len(found))))
    return [found[k] for k in chosen]
