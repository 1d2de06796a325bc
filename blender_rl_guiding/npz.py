"""Reads arrays from .npz files, also from strangers: it checks sizes before it allocates memory, and unpickles no objects.

Needs only numpy, because the add-on reads such files inside Blender's own Python (3.11 or newer).
"""

import io
import math
import tokenize
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy

from .errors import InputError, trying_to
from .memory import available, in_words
from .strings import one_line

# Errors of zipfile, numpy and zlib on a wrong byte. NotImplementedError is a RuntimeError, UnicodeError is a ValueError.
_DAMAGE = (zipfile.BadZipFile, zlib.error, tokenize.TokenError, SyntaxError, EOFError, ArithmeticError, AttributeError)
_DAMAGE += (LookupError, RuntimeError, TypeError, ValueError, AssertionError)


PARSED = 24  # maximal bytes in Python per byte of JSON text in an array with four bytes per character; the worst case is "[[],[]]"
MOST_AT_ONCE = 1 << 24  # maximal bytes of one read from a file
_PACKINGS = zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED  # the methods that numpy uses; with others Python may unpack without limit


class DamagedError(InputError):
    """A file was read, but is of the wrong kind or damaged."""


class _Sparing(io.FileIO):
    """A file that refuses large reads: zipfile reads the whole list of members at once, and needs ten times its size in memory."""

    def read(self, size: int | None = -1, /) -> Any:
        if size and size > MOST_AT_ONCE:
            raise ValueError(f"a list of members of {in_words(size)}")
        return super().read(size)


class Archive:
    """An open file. On faults it raises ValueErrors or other errors; `opened` turns them into InputErrors."""

    def __init__(self, file: zipfile.ZipFile) -> None:
        self._file = file
        self._members = {info.filename: info for info in file.infolist()}

    @property
    def bytes(self) -> int:
        """Bytes of all arrays according to the file. `array` checks this before it allocates memory."""
        return sum(info.file_size for info in self._members.values())

    def text(self, name: str) -> str:
        """An array of one string, which is JSON. InputError if parsing it could take more memory than there is."""
        if (info := self._members.get(f"{name}.npy")) and info.file_size * PARSED > (free := available()):
            raise InputError(f"{name} has {in_words(info.file_size)} of text, which is too much for {in_words(free)} of memory")
        array = self._read(name, lambda dtype, shape: dtype.kind == "U" and shape == ())
        return str(array)

    def array(self, name: str, dtypes: Sequence[Any], shape: Sequence[int | None]) -> np.ndarray:
        """An array with one of these types, and with this shape, where None is any length."""

        def fits(dtype: np.dtype[Any], found: tuple[int, ...]) -> bool:
            return (
                dtype in map(np.dtype, dtypes)
                and len(found) == len(shape)
                and all(s in (None, f) for s, f in zip(shape, found, strict=True))
            )

        return self._read(name, fits)

    def _read(self, name: str, fits: Any) -> np.ndarray:
        if f"{name}.npy" not in self._members:
            raise ValueError(f"there is no {name}")
        info = self._members[f"{name}.npy"]
        if info.compress_type not in _PACKINGS:
            raise ValueError(f"{name} is packed in a way that numpy does not use")
        with self._file.open(info) as stream:
            if npy.read_magic(stream) != (1, 0):  # the version whose header has 64 kB at most
                raise ValueError(f"{name} is of another version of numpy's format")
            shape, transposed, dtype = npy.read_array_header_1_0(stream)
            if dtype.hasobject:
                raise ValueError(f"{name} holds objects, which allow_pickle would unpickle")
            if any(length < 0 for length in shape) or not fits(dtype, shape):
                raise ValueError(f"{name} is {dtype}{shape}")
            if stream.tell() + dtype.itemsize * math.prod(shape) != info.file_size:
                raise ValueError(f"{name} claims to be {dtype}{shape}, but has {info.file_size} bytes")
            array = np.empty(shape[::-1] if transposed else shape, dtype)
            _fill(array, stream, name)
        return np.ascontiguousarray(array.T) if transposed else array  # kernels and Embree need contiguous rows


def _fill(array: np.ndarray, stream: Any, name: str) -> None:
    rest = memoryview(array.reshape(-1).view(np.uint8))
    while len(rest):
        count = stream.readinto(rest[:MOST_AT_ONCE])
        if not count:
            raise ValueError(f"{name} ends early")
        rest = rest[count:]
    if stream.read(1):  # reading to the end also checks the checksum
        raise ValueError(f"{name} goes on after its end")


@contextmanager
def opened(path: Path, what: str) -> Iterator[Archive]:
    """The open file. InputError if it cannot be read or does not fit into memory, DamagedError if it is not `what`."""
    try:
        with trying_to(f"read {path}"), _Sparing(path) as stream, zipfile.ZipFile(stream) as file:
            archive = Archive(file)
            if archive.bytes > (free := available()):
                raise InputError(f"{path} takes {in_words(archive.bytes)} of memory, but only {in_words(free)} are free")
            yield archive
    except MemoryError as error:
        raise InputError(f"{path} takes more memory than there is") from error
    except _DAMAGE as error:
        raise DamagedError(f"{path}: not {what}, or damaged ({one_line(error)})") from error
