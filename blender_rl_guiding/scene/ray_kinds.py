"""Kinds of rays: every ray is of one kind, and sees those things whose visibility has its bit.

To Blender light through a Translucent BSDF is diffuse as well as transmitted. Cycles asks for one of these switches or for both,
depending on what the ray meets. So such rays are a kind of their own here, TRANSLUCENT, which follows from the two switches.
"""

from .description import CAMERA, DIFFUSE, GLOSSY, SHADOW, TRANSMISSION

__all__ = ["CAMERA", "DIFFUSE", "EMITTERS", "GLOSSY", "MESHES", "SHADOW", "TRANSLUCENT", "TRANSMISSION", "WORLD", "seen_by"]

TRANSLUCENT = 32
# The switches that have to be on for TRANSLUCENT: of a mesh that is hit, of an emitter that is sampled, and of the world.
MESHES, EMITTERS, WORLD = TRANSMISSION, DIFFUSE, DIFFUSE | TRANSMISSION


def seen_by(visibility, switches: int):
    """The kinds of rays, TRANSLUCENT among them, that see a thing of this `visibility` in a bundle: an integer, or an array of them."""
    return visibility | TRANSLUCENT * ((visibility & switches) == switches)
