"""How kernels are compiled: two decorators, and a cache folder that changes with the source.

Numba's own cache looks only at the file a function stands in, so a kernel would go stale when a function it calls in another
file changes. Keying the folder by every file that goes into kernels makes that impossible.
"""

import hashlib
import os
from pathlib import Path
from typing import Any

import numba
import numba.core.config


def cache_home() -> Path:
    """The folder for whatever can be made again: compiled kernels and reference images."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "blender_rl_guiding"


def source_key(package: Path) -> str:
    """16 hexadecimal digits that change with the kernels below a folder, with the scene's constants, and with tables of numbers."""
    digest = hashlib.sha256()
    for file in sorted(package.rglob("*")):
        if file.suffix == ".npz" or (file.suffix == ".py" and (file.parent.name == "scene" or _has_kernels(file))):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _has_kernels(file: Path) -> bool:
    source = file.read_bytes()
    return b"import kernel" in source or b"import part" in source or b"numba" in source


setattr(numba.core.config, "CACHE_DIR", str(cache_home() / "kernels" / source_key(Path(__file__).parent)))  # noqa: B010  # unknown to the type checker

# Not full fastmath: it may reorder sums differently in a vectorised loop and in its remainder, so that a path's value would
# depend on its place in the batch; and it assumes away the NaNs that the film looks for.
# Kernels make no arrays, and so need not count references to them, which would be a call for each array at each call.
_options: Any = {"_nrt": False, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz", "arcp"}, "no_cfunc_wrapper": True}

# What Python calls: kept on disk with everything it calls.
kernel = numba.njit(cache=True, **_options)
# What only kernels call: compiled into them. Without wrappers and files of its own it takes half the time.
part = numba.njit(**(_options | {"no_cpython_wrapper": True}))
