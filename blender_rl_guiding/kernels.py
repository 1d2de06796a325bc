"""How kernels are compiled: one decorator, and a cache folder that changes with the source.

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
        if b"import kernel" in source or b"from numba" in source or file == Path(__file__):
            digest.update(source)
    return digest.hexdigest()[:16]


setattr(numba.core.config, "CACHE_DIR", str(cache_home() / "kernels" / _source_key()))  # noqa: B010  # unknown to the type checker

# Not full fastmath: it may reorder sums differently in a vectorised loop and in its remainder, so that a path's value would
# depend on its place in the batch; and it assumes away the NaNs that the film looks for.
kernel = numba.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
