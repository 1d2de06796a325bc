"""Where the rules of shading show: objects of uneven scale, mirrored ones, near clips, narrow beams, terminators of coarse balls."""

from __future__ import annotations

from math import radians
from typing import TYPE_CHECKING, Any

from .registry import CHART, case, each
from .textures import positive, waves

if TYPE_CHECKING:
    from ..stage import Nodes, Stage

UNEVEN, MIRRORED = (1.4, 0.8, 0.5), (-1.2, 0.9, 0.6)


def coarse_chart(s: Stage, scale: tuple[float, float, float], paint: Any) -> None:
    """A flat box and a smooth ball, of few and large triangles, that emit what `paint` computes."""
    material, nodes = s.nodes()
    nodes.surface(nodes.add("Emission", {"Color": paint(nodes)}))
    s.ball(material, segments=8, scale=scale)
    s.box(material, scale=scale)


@each({"uneven": UNEVEN, "mirrored": MIRRORED}, samples=CHART)
def normals_of_a_normal_map(s: Stage, scale: tuple[float, float, float]) -> None:
    coarse_chart(s, scale, lambda nodes: positive(nodes, (waves(s, nodes), "Normal")))


@each({"radial": {"axis": "Y"}, "uv": {"direction_type": "UV_MAP"}}, samples=CHART)
def tangents_of_scaled_objects(s: Stage, attributes: dict[str, str]) -> None:
    coarse_chart(s, MIRRORED, lambda nodes: positive(nodes, nodes.add("Tangent", **attributes)))


@case(samples=CHART)
def parametric_of_mirrored_objects(s: Stage) -> None:
    coarse_chart(s, MIRRORED, lambda nodes: (nodes.add("NewGeometry"), "Parametric"))
