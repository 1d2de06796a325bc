"""The cases of the parity suite: each is a small function that builds a scene to show one feature.

A list of the cases needs no Blender: each case builds its scene through its argument, a `Stage`.
"""

from . import (
    cameras,
    custom,
    edges,
    far,
    geometry,
    integrator,
    lamp_nodes,
    lamps,
    lighting,
    patterns,
    pictures,
    principled,
    simplify,
    skies,
    surfaces,
    textures,
)
from .registry import CASES, Case

__all__ = [
    "CASES",
    "Case",
    "cameras",
    "custom",
    "edges",
    "far",
    "geometry",
    "integrator",
    "lamp_nodes",
    "lamps",
    "lighting",
    "patterns",
    "pictures",
    "principled",
    "simplify",
    "skies",
    "surfaces",
    "textures",
]
