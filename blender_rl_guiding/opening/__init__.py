"""Opens .blend files by a Blender of its own, which exports them."""

from .blend import export, open_scene, opening

__all__ = ["export", "open_scene", "opening"]
