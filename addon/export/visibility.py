"""Which kinds of rays see an object or a lamp."""

import bpy

from blender_rl_guiding.scene.description import CAMERA, DIFFUSE, GLOSSY, SHADOW, TRANSMISSION

RAY_KINDS = {"camera": CAMERA, "diffuse": DIFFUSE, "glossy": GLOSSY, "transmission": TRANSMISSION, "shadow": SHADOW}


def source(instance: bpy.types.DepsgraphObjectInstance) -> bpy.types.Object:
    """The object of the view layer behind an instance: its instancer, or the object itself."""
    return instance.parent if instance.is_instance else instance.object


def visibility(instance: bpy.types.DepsgraphObjectInstance, view_layer: bpy.types.ViewLayer) -> int:
    """The sum of all kinds of rays that both the object and its instancer allow, as in Cycles."""
    seen = _switches(instance.object)
    if instance.is_instance:
        seen &= _switches(instance.parent)
    original = source(instance).original
    if original.indirect_only_get(view_layer=view_layer) and not original.holdout_get(view_layer=view_layer):
        seen &= ~CAMERA
    return seen


def _switches(thing: bpy.types.Object) -> int:
    return sum(bit for kind, bit in RAY_KINDS.items() if getattr(thing, f"visible_{kind}"))
