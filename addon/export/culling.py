"""Culling of Simplify: Cycles leaves out objects that are out of the camera's sight, or far away."""

import bpy
import numpy as np

from blender_rl_guiding.scene.description import Camera


class Culling:
    """Decides from the bounding box of an object. With panoramas and stereoscopy nothing is culled."""

    def __init__(self, scene: bpy.types.Scene, camera: Camera) -> None:
        """`camera` is that of the whole frame."""
        simplified = scene.render.use_simplify and hasattr(scene, "cycles") and camera.kind != "panorama" and not scene.render.use_multiview
        self._sight = simplified and scene.cycles.use_camera_cull
        self._distance = simplified and scene.cycles.use_distance_cull and scene.cycles.distance_cull_margin > 0
        if self._sight or self._distance:
            self._camera, self._place = camera, np.array(camera.to_world)[:3, 3]
            self._to_camera = np.linalg.inv(np.array(camera.to_world))
            self._margin, self._reach = scene.cycles.camera_cull_margin, scene.cycles.distance_cull_margin

    def leaves_out(self, thing: bpy.types.Object, matrix: np.ndarray) -> bool:
        """Whether an object with `matrix`, (4, 4), is culled: by every kind of culling that both the scene and the object enable."""
        sight = self._sight and thing.cycles.use_camera_cull
        distance = self._distance and thing.cycles.use_distance_cull
        if not (sight or distance):
            return False
        box = np.array(thing.bound_box, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
        return (not sight or self._out_of_sight(box)) and (not distance or self._far_away(box))

    def _out_of_sight(self, box: np.ndarray) -> bool:
        """By the places of the corners, (8, 3), in the image: 0 to 1 from left and bottom; mirrored for corners behind the camera."""
        x, y, z = (box @ self._to_camera[:3, :3].T + self._to_camera[:3, 3]).T
        left, right, bottom, top = self._camera.window
        beyond, scale = -z - self._camera.near, self._camera.far - self._camera.near
        if self._camera.kind == "perspective":
            depth, image = beyond * self._camera.far / scale, np.stack([x, y]) / -z
        else:
            depth, image = beyond / scale, np.stack([x, y])
        image = (image.T - (left, bottom)) / (right - left, top - bottom)
        image = np.where(depth[:, None] < 0, 1 - image, image)
        if (depth < -self._margin).all():
            return True
        return bool((image.min(axis=0) >= 1 + self._margin).any() or (image.max(axis=0) <= -self._margin).any())

    def _far_away(self, box: np.ndarray) -> bool:
        nearest = self._place.clip(box.min(axis=0), box.max(axis=0))
        return bool(np.linalg.norm(nearest - self._place) > self._reach)
