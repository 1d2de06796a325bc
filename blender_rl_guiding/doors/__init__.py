"""The ways in: the command `rlg`, and the process that Blender talks to."""
