"""Lights: emitting triangles, lamps and the world. One is chosen in proportion to its power, then a direction towards it."""
