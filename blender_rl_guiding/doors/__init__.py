"""The entry points: the command `rlg`, and the worker process for Blender."""
