"""Shaders as programs: what a surface looks like at a point, computed from textures, attributes and arithmetic."""
