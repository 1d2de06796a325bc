"""Opens .blend files: starts a Blender that exports them."""

from .blend import export, open_scene, opening

__all__ = ["export", "open_scene", "opening"]
