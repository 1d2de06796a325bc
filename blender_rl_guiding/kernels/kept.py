"""Compiled kernels on disk: one file with a checksum for each. A damaged kernel is compiled again.

Numba's own cache is not used: it unpickles and runs any file in its folder, and its index loses or mixes up files if two processes write
at the same time.
"""

import hashlib
import os
import pickle
import platform
import shutil
import time
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import llvmlite
import numpy as np
from numba import __version__ as numba_version
from numba.core import config
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature

from ..cache import dispensable
from ..errors import atomic
from ..notices import tell

_CONFIG: Any = config  # unknown to the type checker
UNUSED = 30  # days without use; then the kernels of another version of the source are removed


class Kept(NullCache):
    """The compiled code of one function in a folder, one file for each signature. Replaces the cache of a Numba dispatcher."""

    def __init__(self, folder: Path, function: Callable[..., Any]) -> None:
        self._folder, self._function = folder, function

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled code for these types; None if there is none. Also None, with a notice, if the file is unreadable or damaged."""
        target_context.refresh()
        path = self._path(sig, target_context.codegen())
        try:
            held = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            tell(f"cannot read {path}: {error.strerror or error}; it is compiled again")
            return None
        payload = held[32:]
        if held[:32] != _digest(path.name, payload):
            tell(f"the kernel {path} is damaged: it is compiled again")
            return None
        found = CompileResult._rebuild(target_context, *pickle.loads(payload))
        return found if found.signature.args == normalize_signature(sig)[0] else None  # different types may have the same name

    def save_overload(self, sig: Any, cres: Any) -> None:
        """Write the code compiled for these types, if the folder is writable."""
        assert not cres.lifted, self._function
        assert not cres.library.has_dynamic_globals, self._function
        path, payload = self._path(sig, cres.codegen), dumps(cres._reduce())
        with dispensable(path), atomic(path, durable=False) as part:
            part.write_bytes(_digest(path.name, payload) + payload)

    def _path(self, sig: Any, codegen: Any) -> Path:
        """The file. Its name is a hash of all that decides the code, without the program's other files: the folder's name covers these."""
        code, cells = self._function.__code__, [cell.cell_contents for cell in self._function.__closure__ or ()]
        versions = numba_version, llvmlite.__version__, np.__version__, platform.python_version(), _CONFIG.BOUNDSCHECK
        key = f"{sig} {codegen.magic_tuple()} {versions} {code.co_firstlineno} {_hash_of(code.co_filename)}"
        digest = hashlib.sha256(key.encode() + code.co_code + dumps(cells)).hexdigest()
        return self._folder / f"{self._function.__name__}-{digest[:32]}.kernel"


@lru_cache
def _hash_of(file: str) -> str:
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


def _digest(name: str, payload: bytes) -> bytes:
    """SHA-256 of name and payload: a file under the name of another file does not match."""
    return hashlib.sha256(name.encode() + payload).digest()


def sweep(folder: Path) -> None:
    """Mark a folder as used now, and remove its neighbours that were not used for `UNUSED` days."""
    try:
        os.utime(folder)
        for other in folder.parent.iterdir():
            if other.stat().st_mtime < time.time() - UNUSED * 86400:
                shutil.rmtree(other, ignore_errors=True)
    except OSError:
        return  # not writable (`cache.folder` tells this), or another process removes the same folders
