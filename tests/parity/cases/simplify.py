"""Simplify, as far as it is Cycles' own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .registry import CHART, each

if TYPE_CHECKING:
    from ..stage import Nodes, Stage


@each(
    {
        "codes": {"alpha": True},
        "data": {"colorspace": "Non-Color"},
        "floats": {"float_buffer": True, "alpha": True},
        "narrow": {"width": 2, "height": 260},
        "odd": {"width": 150, "height": 131},
    },
    samples=CHART,
)
def limited_texture(s: Stage, options: dict[str, Any]) -> None:
    """By Simplify to 128 pixels a side; the number of texels is not a multiple of what becomes one."""
    s.scene.render.use_simplify, s.scene.cycles.texture_limit_render = True, "128"
    picture = s.image(**({"width": 260, "height": 259} | options))
    texels = np.empty((picture.size[1], picture.size[0], 4), np.float32)
    picture.pixels.foreach_get(texels.ravel())
    texels[1::2, :, :3] *= 0.2  # so that wrong squares and no limit show
    texels[:, : picture.size[0] // 2, :3] **= 2
    picture.pixels.foreach_set(texels.ravel())
    picture.pack()

    def paint(nodes: Nodes) -> Any:
        part = nodes.add("Mapping", {"Vector": (nodes.add("TexCoord"), "UV"), "Scale": (0.1, 0.1, 0.1), "Location": (0.45, 0.45, 0.0)})
        texture = nodes.add("TexImage", {"Vector": part}, image=picture, interpolation="Closest")
        return nodes.add("Mix", {"Factor_Float": (texture, "Alpha"), "A_Color": (0.2, 0.3, 0.4), "B_Color": texture}, data_type="RGBA")

    s.chart(paint)
