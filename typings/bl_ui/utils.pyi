"""Stands for Blender's module bl_ui.utils, which has no type stubs: anything in it is Any."""

from typing import Any

def __getattr__(name: str) -> Any: ...
