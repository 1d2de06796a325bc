"""Stands for Blender's module bpy, which has no type stubs: anything in it is Any."""

from typing import Any

def __getattr__(name: str) -> Any: ...
