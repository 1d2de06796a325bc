"""How kernels are compiled: two decorators, and a cache folder that changes with the source.

Numba's own cache looks only at the file a function stands in, so a kernel would go stale when a function it calls in another
file changes. Keying the folder by the source of every file that has kernels makes that impossible.
"""

import hashlib
import os
from pathlib import Path

import numba
import numba.core.config


def cache_home() -> Path:
    """The folder for whatever can be made again: compiled kernels and reference images."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "blender_rl_guiding"


def _source_key() -> str:
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parent.rglob("*.py")):
        source = file.read_bytes()
        if b"import kernel" in source or b"import part" in source or b"numba" in source:
            digest.update(source)
    return digest.hexdigest()[:16]


setattr(numba.core.config, "CACHE_DIR", str(cache_home() / "kernels" / _source_key()))  # noqa: B010  # unknown to the type checker

# Not full fastmath: it may reorder sums differently in a vectorised loop and in its remainder, so that a path's value would
# depend on its place in the batch; and it assumes away the NaNs that the film looks for.
# Kernels make no arrays, and so need not count references to them, which would be a call for each array at each call.
_options = {"_nrt": False, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz", "arcp"}, "no_cfunc_wrapper": True}

# What Python calls: kept on disk with everything it calls.
kernel = numba.njit(cache=True, **_options)# What only kernels call: compiled into them. Without wrappers and files of its own it takes half the time.
part = numba.njit(no_cpython_wrapper=True, **_options)
