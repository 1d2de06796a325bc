"""Kinds of rays. Every ray has one kind, and sees the things whose visibility has the bit of this kind.

In Blender, light through a Translucent BSDF is both diffuse and transmitted. Cycles checks one of these two switches, or both, depending
on the thing that the ray meets. Here such rays have their own kind, TRANSLUCENT; its bit is computed from the two switches.
"""

from .description import CAMERA, DIFFUSE, GLOSSY, SHADOW, TRANSMISSION

__all__ = ["CAMERA", "DIFFUSE", "EMITTERS", "GLOSSY", "MESHES", "SHADOW", "TRANSLUCENT", "TRANSMISSION", "WORLD", "seen_by"]

TRANSLUCENT = 32
# The switches that must be on for TRANSLUCENT: of a mesh that a ray hits, of an emitter that is sampled, of the world.
MESHES, EMITTERS, WORLD = TRANSMISSION, DIFFUSE, DIFFUSE | TRANSMISSION


def seen_by(visibility, switches: int):
    """The kinds of rays, with TRANSLUCENT, that see a thing. visibility: from the bundle, an integer or an array of integers.

    switches: MESHES, EMITTERS or WORLD, the switches that TRANSLUCENT needs.
    """
    return visibility | TRANSLUCENT * ((visibility & switches) == switches)
