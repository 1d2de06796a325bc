"""Stands for Blender's module bl_ui, which has no type stubs."""
