"""Damage to arrays, and to the zips of arrays that NumPy reads. A generator draws it: the same seed does it again."""

import io
import os
import random
import struct
import warnings
import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np

from .mutations import damaged_bytes

INTEGERS = (0, -1, -2, 1, 2, 3, 7, 31, 32, 255, 1000, 10**6, 2**24, 2**31 - 1, 2**31, -(2**31), 2**62)
FLOATS = (
    *(0.0, 1.0, -1.0, 1e-45, 1e-38, 1e-10, 1e9, 1e10, 2e18, 1e19, 1e30, -1e30, 3.4e38, -3.4e38),
    *(float("nan"), float("inf"), float("-inf")),
)


class Opened:
    """An object that writes when it is unpickled. The program must not unpickle it."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, ("unpickled",)


def damaged_array(array: np.ndarray, rng: random.Random) -> np.ndarray:
    """An array with other numbers, another type, shape, length or order; or one of objects."""
    match rng.choice(("number", "number", "number", "number", "length", "length", "order", "type", "shape", "objects")):
        case "number":
            return spoiled_array(array, rng)
        case "type":
            with np.errstate(all="ignore"):
                return array.astype(rng.choice(("f2", "f4", "f8", "i1", "u1", "i4", "i8", "u8", "c8", "?", ">f4", ">i4", "S4", "U4")))
        case "shape":
            return rng.choice(
                (array[None], array.reshape(-1), array.reshape(*array.shape, 1), array.T, np.zeros((0,) * array.ndim, array.dtype))
            )
        case "objects":
            return np.array([Opened()], object) if rng.random() < 0.5 else np.zeros(2, [("a", "f4"), ("b", "O")])
        case "order" if array.ndim:
            return rng.choice((np.asfortranarray(array), array[::-1], np.roll(array, 1, rng.randrange(array.ndim))))
        case _:
            return resized_array(array, rng)


def spoiled_array(array: np.ndarray, rng: random.Random) -> np.ndarray:
    """An array with an extreme of its type at one place, in one row, or everywhere."""
    new = np.array(array)
    if array.size:
        place = tuple(rng.randrange(n) for n in array.shape)
        with np.errstate(all="ignore"):
            new[place[: rng.randint(0, array.ndim)]] = _extreme(array.dtype, rng)
    return new


def _extreme(dtype: np.dtype, rng: random.Random) -> Any:
    if dtype.kind not in "iu":
        return rng.choice(FLOATS)
    info = np.iinfo(dtype)
    number = rng.choice((*INTEGERS, info.min, info.max, info.max - 1, info.max // 2))
    return min(max(number, info.min), info.max)


def resized_array(array: np.ndarray, rng: random.Random) -> np.ndarray:
    """An array that is shorter, or has rows twice. One without rows stays."""
    if not array.ndim or not array.size:
        return array
    twice, last_twice = np.concatenate([array, array]), np.concatenate([array, array[-1:]])
    return rng.choice((array[:-1], array[1:], array[:0], array[::2], twice, last_twice))


# ----------------------------------------------------------------------------------------------------------------- zips


def archive(members: Mapping[str, np.ndarray | bytes], rng: random.Random | None = None) -> bytes:
    """An .npz of arrays, or of members as they are. With a generator, the zip itself is damaged: members doubled, packed, lying."""
    out = io.BytesIO()
    how = rng.choice(("packed", "double", "claim", "magic", "bomb", "size", "method", "bytes", "bytes", "none")) if rng else "none"
    chosen = rng.choice(list(members)) if rng else ""
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED if how in ("packed", "bomb") else zipfile.ZIP_STORED) as file:
        for name, member in members.items():
            data = member if isinstance(member, bytes) else npy(member)
            if name == chosen and rng:
                data = _lying(data, how, rng)
            file.writestr(f"{name}.npy", data)
        if rng and how == "double":
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # two members of one name are meant
                file.writestr(rng.choice((f"{chosen}.npy", "../../canary.txt", "/canary.npy")), npy(np.zeros(3)))
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
    """The bytes of an array with a head that is false."""
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
    """A zip with a directory that is false: a member has another size, or is packed in a way that does not exist."""
    entries = [k for k in range(len(data) - 4) if data[k : k + 4] == b"PK\x01\x02"]
    k, new = rng.choice(entries), bytearray(data)
    if how == "size":
        new[k + 24 : k + 28] = struct.pack("<I", rng.choice((0, 1, 1 << 20, (1 << 32) - 2, (1 << 32) - 1)))
    else:
        new[k + 8 : k + 12] = struct.pack("<HH", rng.choice((0, 1)), rng.choice((1, 9, 12, 14, 99)))
    return bytes(new)
