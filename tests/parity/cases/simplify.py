"""The settings of Simplify that belong to Cycles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .registry import CHART, each

if TYPE_CHECKING:
    from ..stage import Nodes, Stage


@each(
    {
        "codes": {"alpha": True},
        "floats": {"float_buffer": True, "alpha": True},
        "narrow": {"width": 2, "height": 260},
    },
    samples=CHART,
)
def limited_texture(s: Stage, options: dict[str, Any]) -> None:
    """Simplify limits an image to 128 pixels per side. The image's size is not a multiple of the reduction factor."""
    s.scene.render.use_simplify, s.scene.cycles.texture_limit_render = True, "128"
    picture = s.image(**({"width": 260, "height": 259} | options))
    texels = np.empty((picture.size[1], picture.size[0], 4), np.float32)
    picture.pixels.foreach_get(texels.ravel())
    texels[1::2, :, :3] *= 0.2  # makes wrong blocks of texels visible, and also a missing limit
    texels[:, : picture.size[0] // 2, :3] **= 2
    picture.pixels.foreach_set(texels.ravel())
    picture.pack()

    def paint(nodes: Nodes) -> Any:
        part = nodes.add("Mapping", {"Vector": (nodes.add("TexCoord"), "UV"), "Scale": (0.1, 0.1, 0.1), "Location": (0.45, 0.45, 0.0)})
        texture = nodes.add("TexImage", {"Vector": part}, image=picture, interpolation="Closest")
        return nodes.add("Mix", {"Factor_Float": (texture, "Alpha"), "A_Color": (0.2, 0.3, 0.4), "B_Color": texture}, data_type="RGBA")

    s.chart(paint)


SIGHT, DISTANCE = {"use_camera_cull": True, "camera_cull_margin": 0.1}, {"use_distance_cull": True, "distance_cull_margin": 7.0}
CULLED = {
    "sight": ("PERSP", SIGHT),
    "wide_sight": ("ORTHO", SIGHT | {"camera_cull_margin": 0.3}),
    "distance": ("PERSP", DISTANCE),
    "both": ("PERSP", SIGHT | DISTANCE),
}


@each(CULLED)
def culling(s: Stage, variant: tuple[str, dict[str, Any]]) -> None:
    """Boxes around and behind the camera; the image shows their shadows. The nearest box has culling off."""
    kind, settings = variant
    s.camera.data.type, s.camera.data.ortho_scale = kind, 5.0
    s.scene.render.use_simplify = True
    for name, value in settings.items():
        setattr(s.scene.cycles, name, value)
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.lamp("SUN", power=2.0, angle=0.3).rotation_euler = (0.0, -0.9, 0.0)
    s.sky((0.2, 0.3, 0.5))
    places = (-4.2, 0.0, 0.9), (-5.8, 1.5, 1.9), (3.2, 1.0, 1.2), (0.0, 4.5, 1.5), (-1.6, -7.5, 5.0), (0.0, 0.0, 0.9), (2.0, -3.0, 0.9)
    for number, at in enumerate(places):
        box = s.box(s.diffuse((0.8, 0.1 * number, 0.2)), at=at, scale=(1.0, 1.0, at[2]))
        box.cycles.use_camera_cull = box.cycles.use_distance_cull = number < len(places) - 1
