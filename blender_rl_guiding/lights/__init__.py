"""Lights: emitting triangles, lamps and the world. One is chosen by its power, then a direction towards it; both have a pdf."""
