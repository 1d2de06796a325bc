"""Lights: emitting triangles, lamps and the world. Light sampling picks one light in proportion to its power, then a direction to it."""
