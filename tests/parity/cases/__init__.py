"""The cases of the parity suite: each is a small function that builds a scene to show one feature.

Listing them needs no Blender: they get everything from the `Stage` that they are called with.
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
