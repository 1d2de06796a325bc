"""Where the user's cache is. Standard library only: the add-on keeps things there, too."""

import os
from pathlib import Path


def cache_home() -> Path:
    """The folder for whatever can be made again: compiled kernels, reference images and skies."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "blender_rl_guiding"
