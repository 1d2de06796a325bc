"""Ways to damage what is read from files: JSON, arrays, bytes and zips. All chances are the generator's, so that a seed does it again."""

import copy
import io
import json
import os
import random
import struct
import warnings
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

DEEP, DIGITS, TWICE = "@deep@", "@digits@", "@twice@"  # stand for text that no value has; see `text`
LARGEST, SMALLEST = 1.7976931348623157e308, 5e-324  # finite, float64
NUMBERS = (
    *(0, 1, -1, 2, 255, 256, 65535, 65536, 2**31 - 1, 2**31, -(2**31), 2**32, 2**53 + 1, 2**63 - 1, 2**63, -(2**63), 2**64, 10**30),
    *(-0.0, 0.5, -0.5, 1.0000001, 1e-9, 1e9, 1e30, -1e30, 3.5e38, LARGEST, SMALLEST, float("nan"), float("inf"), float("-inf")),
)
TEXTS = (
    *("", " ", ".", "..", "a/b", "../../canary.txt", "../../../canary", "a/../../../../x", "\x00", "a\x00b", "\n", "two\nlines", "\r"),
    *("\x1b[31mred\x1b[0m", "\ud800", "\udfff", "\u202e", "é" * 40, "x" * 300, "x" * 5000, "💥", "NaN", "null", "1", "-1"),
    *(
        "{{body}}",
        "{{title}}",
        "<script>alert(1)</script>",
        "</script>",
        "&amp;",
        "=cmd|' /C calc'!A0",
        "\\input{/etc/passwd}",
        "%s%n",
        "$x^$",
    ),
    *("CON", "nul.", "-rf", "~", "$HOME", "%TEMP%", "*", "[red]", DEEP, DIGITS),
)
OTHERS = (None, True, False, [], {}, [[]], [None], {"": None}, {"kind": "dqn"}, [1, 2, 3], [[1.0] * 4] * 4, [[0.0] * 4] * 3, [0] * 1000)


class Opened:
    """What unpickling must never come to: it writes a file."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, ("unpickled",)


# ---------------------------------------------------------------------------------------------------------------- JSON


def places(value: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The keys that lead to each part of plain data, itself first."""
    yield above
    parts = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in parts:
        yield from places(part, (*above, key))


def at(value: Any, place: Sequence[Any]) -> Any:
    """The part of plain data that keys lead to."""
    for key in place:
        value = value[key]
    return value


def damaged(value: Any, rng: random.Random, texts: Sequence[str] = TEXTS, times: int | None = None) -> Any:
    """Plain data with one to three parts changed, deleted, doubled, renamed or exchanged. `texts` are among what text becomes."""
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
            holder[key] = extreme(holder[key], rng, texts)
        case "near":
            holder[key] = near(holder[key], rng, texts)
        case "delete":
            del holder[key]
        case "twice" if isinstance(holder, list):
            holder[key:key] = [copy.deepcopy(holder[key])] * rng.choice((1, 2, 100))
        case "exchange":
            other = rng.choice(there)
            holder[key] = copy.deepcopy(at(value, other))
        case "nest":
            holder[key] = rng.choice(([holder[key]], {"kind": holder[key]}, [[holder[key]] * 2]))
        case _ if isinstance(holder, dict):
            holder[rng.choice((*texts, f"{key}s", str(key).upper()))] = holder.pop(key)
    return value


def extreme(value: Any, rng: random.Random, texts: Sequence[str] = TEXTS) -> Any:
    """What may stand where a value stood: mostly of its own type, as others are found out at once."""
    own: Sequence[Any] = texts if isinstance(value, str) else NUMBERS if isinstance(value, int | float) else OTHERS
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
    """JSON of damaged data: one in ten with its text damaged, too."""
    said = json.dumps(value)
    said = said.replace(f'"{DEEP}"', "[" * 100_000 + "]" * 100_000).replace(f'"{DIGITS}"', "9" * 5000)
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
            said.replace("{", f'{{"{TWICE}": 1, "{TWICE}": 2, ', 1),
        )
    )


# -------------------------------------------------------------------------------------------------------------- arrays


def damaged_array(array: np.ndarray, rng: random.Random) -> np.ndarray:
    """An array with values, type, shape or order changed."""
    match rng.choice(("value", "value", "value", "values", "type", "shape", "length", "length", "order", "objects")):
        case "value" if array.size:
            return _with(array, rng.randrange(array.size), _number(array.dtype, rng))
        case "values" if array.size:
            return np.full_like(array, _number(array.dtype, rng))
        case "type":
            with np.errstate(all="ignore"):
                return array.astype(rng.choice(("f2", "f4", "f8", "i1", "u1", "i4", "i8", "u8", "c8", "?", ">f4", ">i4", "S4", "U4")))
        case "shape":
            return rng.choice(
                (array[None], array.reshape(-1), array.reshape(*array.shape, 1), array.T, np.zeros((0,) * array.ndim, array.dtype))
            )
        case "length" if array.ndim and len(array):
            return rng.choice(
                (array[:-1], array[1:], array[:0], np.concatenate([array, array]), array[::2], np.concatenate([array, array[-1:]]))
            )
        case "objects":
            return np.array([Opened()], object) if rng.random() < 0.5 else np.zeros(2, [("a", "f4"), ("b", "O")])
        case _ if array.ndim:
            return np.asfortranarray(array) if rng.random() < 0.5 else array[::-1]
    return array


def _number(dtype: np.dtype, rng: random.Random) -> Any:
    if dtype.kind in "iu":
        info = np.iinfo(dtype)
        number = rng.choice((info.min, info.max, info.max - 1, 0, -1, 1, 2, 3, 7, 31, 255, 1000, 10**6, 2**31, 2**62, info.max // 2))
        return min(max(number, info.min), info.max)
    numbers = (0, 1, -1, 1e-38, 1e-45, 1e30, -1e30, 3e38, 1e19, 1e10, 1e-10, float("nan"), float("inf"))
    return rng.choice(numbers)


def _with(array: np.ndarray, index: int, value: Any) -> np.ndarray:
    new = np.array(array)
    with np.errstate(all="ignore"):
        new.reshape(-1)[index] = value
    return new


# --------------------------------------------------------------------------------------------------------------- bytes


def damaged_bytes(data: bytes, rng: random.Random) -> bytes:
    """Bytes with bits flipped, or a part cut off, emptied, doubled, exchanged or put in."""
    new = bytearray(data)
    a, b = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    match rng.choice(("flip", "flip", "flip", "cut", "zero", "double", "exchange", "put", "head")):
        case "flip" if data:
            for _ in range(rng.choice((1, 1, 4, 64))):
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


# ----------------------------------------------------------------------------------------------------------------- zips


def archive(members: Mapping[str, np.ndarray | bytes], rng: random.Random | None = None) -> bytes:
    """An .npz of arrays, or of members as they are. With chances its structure is damaged: members doubled, packed, lying."""
    out = io.BytesIO()
    how = rng.choice(("packed", "double", "claim", "magic", "bomb", "size", "method", "bytes", "bytes", "none")) if rng else "none"
    chosen = rng.choice(list(members)) if rng else ""
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED if how in ("packed", "bomb") else zipfile.ZIP_STORED) as file:
        for name, member in members.items():
            data = member if isinstance(member, bytes) else npy(member)
            if name == chosen and rng:
                data = _lying(data, how, rng)
            file.writestr(f"{name}.npy", data)
        if how == "double":
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # that there are two of them is the point
                file.writestr(rng.choice((f"{chosen}.npy", "../../canary.txt", "/canary.npy")) if rng else "", npy(np.zeros(3)))
    data = out.getvalue()
    if rng and how in ("size", "method"):
        return _in_directory(data, how, rng)
    return damaged_bytes(data, rng) if rng and how == "bytes" else data


def npy(array: np.ndarray) -> bytes:
    """An array as the bytes of a .npy file; objects are pickled."""
    out = io.BytesIO()
    np.lib.format.write_array(out, np.asanyarray(array), allow_pickle=True)
    return out.getvalue()


def _lying(data: bytes, how: str, rng: random.Random) -> bytes:
    """The bytes of an array whose first words claim something else."""
    if how == "bomb":
        return _head(rng.choice(((1 << 20, 3), (1 << 22,), (1 << 40, 3), (1 << 62,)))) + bytes(rng.choice((0, 1 << 22)))
    if how == "claim":
        return _head(rng.choice(((1 << 45, 3), (-1, 3), (1 << 63,), (3,) * 200, (0, 1 << 62), (1 << 31, 1 << 31)))) + data[128:]
    if how == "magic":
        return rng.choice(
            (b"", b"\x93NUMPY", b"\x93NUMPY\x03\x00" + data[8:], b"\x93NUMPY\x09\x00" + data[8:], data[:8] + b"\xff\xff" + data[10:])
        )
    return data


def _head(shape: tuple[int, ...]) -> bytes:
    said = repr({"descr": "<f4", "fortran_order": False, "shape": shape}).encode()
    said += b" " * (-(len(said) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(said)) + said


def _in_directory(data: bytes, how: str, rng: random.Random) -> bytes:
    """A zip whose directory lies about the size of a member, or names a way of packing that there is not."""
    entries = [k for k in range(len(data) - 4) if data[k : k + 4] == b"PK\x01\x02"]
    k, new = rng.choice(entries), bytearray(data)
    if how == "size":
        new[k + 24 : k + 28] = struct.pack("<I", rng.choice((0, 1, 1 << 20, (1 << 32) - 2, (1 << 32) - 1)))
    else:
        new[k + 8 : k + 12] = struct.pack("<HH", rng.choice((0, 1)), rng.choice((1, 9, 12, 14, 99)))
    return bytes(new)
