"""The command of a Blender of the same kind, without a window and without the user's add-ons and preferences."""

import sys
from pathlib import Path

import bpy


def command(script: Path) -> list[str]:
    """Runs a script; the arguments of the script follow."""
    if bpy.app.binary_path:
        return [bpy.app.binary_path, "--background", "--factory-startup", "--python-exit-code", "1", "--python", str(script), "--"]
    return [sys.executable, str(script), "--"]  # the bpy module
