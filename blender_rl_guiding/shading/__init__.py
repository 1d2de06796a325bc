"""Shaders as programs, which compute the closures of a surface at a point from textures, attributes and arithmetic."""
