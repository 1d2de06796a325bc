"""Kinds of rays as the tracer has them: every ray is of one kind, and asks for one bit of what it may see.

Blender's switches name light through a Translucent BSDF diffuse as well as transmitted, and Cycles asks for one of them or for both,
depending on what is there to be seen. So such rays are of a kind of their own, which follows from the two switches.
"""

from .description import CAMERA, DIFFUSE, GLOSSY, SHADOW, TRANSMISSION

__all__ = ["CAMERA", "DIFFUSE", "EMITTERS", "GLOSSY", "MESHES", "SHADOW", "TRANSLUCENT", "TRANSMISSION", "WORLD", "seen_by"]

TRANSLUCENT = 32
# The switches that have to be on for it: of a mesh that a ray may hit, of an emitter that is sampled, and of the world.
MESHES, EMITTERS, WORLD = TRANSMISSION, DIFFUSE, DIFFUSE | TRANSMISSION


def seen_by(visibility, switches: int):
    """Kinds of rays, TRANSLUCENT among them, that see things of a bundle's `visibility`: a number, or an array of integers."""
    return visibility | TRANSLUCENT * ((visibility & switches) == switches)
