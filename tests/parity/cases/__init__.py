"""The cases of the parity suite: each is a small function that builds a scene to show one feature.

Listing them needs no Blender: a case gets all it needs from its argument, a `Stage`.
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
