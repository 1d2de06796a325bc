"""Images in the slots of the Render Result, where J flips between them as between renders."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy
import numpy as np

from blender_rl_guiding.errors import InputError

from .. import capture
from ..export.images import stored_pixels
from ..neutral import PIPELINE, apply, first_layer

_OWN = PIPELINE | {"use_border": False, "resolution_percentage": 100}


def put(scene: bpy.types.Scene, images: dict[str, bpy.types.Image]) -> None:
    """Put each image into the slot with its name, and show the first. Slots with other names stay unchanged.

    Only a render can fill a slot, so this renders with an engine that returns a stored image. InputError if Blender refuses.
    """
    shown: list[np.ndarray] = []

    class Show(bpy.types.RenderEngine):
        """An engine that returns stored pixels."""

        bl_idname = "RL_GUIDED_SHOW"
        bl_label = "RL Guided Show"

        def render(self, depsgraph: bpy.types.Depsgraph) -> None:
            height, width, _ = shown[0].shape
            result = self.begin_result(0, 0, width, height)
            result.layers[0].passes["Combined"].rect.foreach_set(shown[0].ravel())
            self.end_result(result)

    bpy.utils.register_class(Show)
    try:
        for name, image in images.items():
            shown[:] = [pixels(image)]
            _choose_slot(name)
            with _rendering(scene, Show.bl_idname, image.size):
                capture.render(scene, first_layer(scene))
            if name not in [slot.name for slot in _slots()]:  # this render has made the first Render Result
                _slots().active.name = name
        _choose_slot(next(iter(images)))
    finally:
        bpy.utils.unregister_class(Show)


def result() -> bpy.types.Image | None:
    """The Render Result. It exists after the first render."""
    return next((image for image in bpy.data.images if image.type == "RENDER_RESULT"), None)


def pixels(image: bpy.types.Image) -> np.ndarray:
    """(height, width, 4) float32, linear, bottom row first. InputError if the file of the image is gone."""
    if not all(image.size):
        raise InputError(f"the image '{image.name}' is not at {image.filepath}")
    texels = np.ascontiguousarray(stored_pixels(image)[::-1])
    texels[..., 3] = 1.0
    return texels


def _slots() -> Any:
    """The slots; without a Render Result there are none."""
    there = result()
    return there.render_slots if there else ()


def _choose_slot(name: str) -> None:
    """Make the slot of that name the active one, a new one if need be."""
    if slots := _slots():
        names = [slot.name for slot in slots]
        if name not in names:
            slots.new(name=name)
        slots.active_index = names.index(name) if name in names else len(names)


@contextmanager
def _rendering(scene: bpy.types.Scene, engine: str, size: Any) -> Iterator[None]:
    """In this block the scene's render settings are the settings for an image of that size."""
    own = _OWN | {"engine": engine, "resolution_x": size[0], "resolution_y": size[1]}
    before = {name: getattr(scene.render, name) for name in own if hasattr(scene.render, name)}
    try:
        apply(own, scene.render)
        yield
    finally:
        apply(before, scene.render)
