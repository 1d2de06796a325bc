"""A guide's state in a file: arrays by name. Anyone may have made the file."""

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..npz import Archive

Arrays = dict[str, np.ndarray]


def below(prefix: str, arrays: Arrays) -> Arrays:
    """The same arrays under the names `prefix.name`. `Saved.below` removes the prefix."""
    return {f"{prefix}.{name}": array for name, array in arrays.items()}


def digest(array: np.ndarray) -> str:
    """SHA-256 of an array's type, shape and bytes. It must be contiguous."""
    found = hashlib.sha256(f"{array.dtype.str}{array.shape}".encode())
    found.update(array.data)
    return found.hexdigest()


class Saved:
    """The arrays of a file. Reading an array checks its digest: ValueError if the array is not the one that was written."""

    def __init__(self, file: Archive, digests: Mapping[str, str], prefix: str = "") -> None:
        """`digests`: the `digest` of each array."""
        self._file, self._digests, self._prefix = file, digests, prefix

    def below(self, prefix: str) -> "Saved":
        """The arrays whose names begin with the prefix and a dot."""
        return Saved(self._file, self._digests, f"{self._prefix}{prefix}.")

    def array(self, name: str, dtype: Any, *shape: int | None) -> np.ndarray:
        """A contiguous array; None stands for any length."""
        name = self._prefix + name
        array = np.asarray(self._file.array(name, [dtype], shape), order="C")
        if self._digests.get(name) != digest(array):
            raise ValueError(f"{name} is not what was written")
        return array

    def whole(self, name: str, low: int, high: int) -> int:
        """A whole number within inclusive limits."""
        value = int(self.array(name, np.int64))
        if not low <= value <= high:
            raise ValueError(f"{self._prefix}{name} is {value}, not within {low} and {high}")
        return value
