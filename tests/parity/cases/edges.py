"""Edges of shading: uneven scale, mirrored objects, near clips, narrow beams, terminators of coarse balls."""

from __future__ import annotations

from math import radians
from typing import TYPE_CHECKING, Any

from .registry import CHART, case, each
from .textures import positive, waves

if TYPE_CHECKING:
    from ..stage import Nodes, Stage

UNEVEN, MIRRORED = (1.4, 0.8, 0.5), (-1.2, 0.9, 0.6)


def coarse_chart(s: Stage, scale: tuple[float, float, float], paint: Any) -> None:
    """A flat box, a smooth ball with few large triangles, and a floor. All emit the colour of `paint`."""
    material, nodes = s.nodes()
    nodes.surface(nodes.add("Emission", {"Color": paint(nodes)}))
    s.floor(material, scale=(scale[0], 1.0, 1.0))
    s.ball(material, segments=8, scale=scale)
    s.box(material, scale=scale)


@each({"uneven": UNEVEN, "mirrored": MIRRORED}, samples=CHART)
def normals_of_a_normal_map(s: Stage, scale: tuple[float, float, float]) -> None:
    coarse_chart(s, scale, lambda nodes: positive(nodes, (waves(s, nodes), "Normal")))


@each({"radial": {"axis": "Z"}, "uv": {"direction_type": "UV_MAP"}}, samples=CHART)
def tangents_of_scaled_objects(s: Stage, attributes: dict[str, str]) -> None:
    coarse_chart(s, MIRRORED, lambda nodes: positive(nodes, nodes.add("Tangent", **attributes)))


@case(samples=CHART)
def parametric_of_mirrored_objects(s: Stage) -> None:
    coarse_chart(s, MIRRORED, lambda nodes: (nodes.add("NewGeometry"), "Parametric"))


@case(samples=CHART)
def ray_length(s: Stage) -> None:
    """The length of rays: from the near clip, through a transparent surface, and after a mirror."""

    def paint(nodes: Nodes) -> Any:
        return nodes.add("VectorMath", {"Vector": (nodes.add("LightPath"), "Ray Length"), "Scale": 0.1}, operation="SCALE")

    s.chart(paint)
    s.floor(s.material("BsdfGlossy", {"Roughness": 0.0}), size=3.0, location=(0.0, 2.0, 1.5), rotation_euler=(1.2, 0.0, 0.0))
    s.floor(s.material("BsdfTransparent", {}), size=3.0, location=(-1.0, -2.0, 1.5), rotation_euler=(1.2, 0.0, 0.0))
    s.camera.data.clip_start = 1.5


@each(
    {
        "rectangle": {"shape": "RECTANGLE", "size": 4.0, "size_y": 2.5, "spread": 0.0},
        "ellipse": {"shape": "ELLIPSE", "size": 4.0, "size_y": 3.0, "spread": 0.0},
    },
    samples=96,
)
def area_beam(s: Stage, attributes: dict[str, Any]) -> None:
    s.set()
    s.lamp("AREA", (0.5, -1.2, 3.5), 150.0, **attributes)


LAMPS = {
    "sun": ("SUN", 3.0, {"angle": 0.0}),
    "wide_sun": ("SUN", 3.0, {"angle": radians(40)}),
    "point": ("POINT", 500.0, {"shadow_soft_size": 0.0}),
    "soft_point": ("POINT", 500.0, {"shadow_soft_size": 1.0}),
}


@each(LAMPS)
def terminator(s: Stage, lamp: tuple[str, float, dict[str, Any]]) -> None:
    """A coarse smooth ball in grazing light."""
    kind, power, attributes = lamp
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(s.diffuse((0.8, 0.35, 0.12)), at=(0.0, 0.0, 1.2), segments=8, rotation_euler=(0.3, 0.2, 0.1))
    s.lamp(kind, (4.0, -0.5, 2.5), power, **attributes)


@each(
    {
        "translucent": ("BsdfTranslucent", {"Color": (0.8, 0.35, 0.12)}),
        "glossy": ("BsdfAnisotropic", {"Roughness": 0.6}),
        "sheen": ("BsdfSheen", {"Roughness": 0.6}),
        "principled": ("BsdfPrincipled", {"Base Color": (0.8, 0.35, 0.12), "Roughness": 0.5}),
    }
)
def terminator_of(s: Stage, shader: tuple[str, dict[str, Any]]) -> None:
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(s.material(*shader), at=(0.0, 0.0, 1.2), segments=8, rotation_euler=(0.3, 0.2, 0.1))
    s.lamp("SUN", (4.0, -0.5, 2.5), 3.0, angle=0.0)


@case()
def terminator_from_inside(s: Stage) -> None:
    """The lower half of a smooth ball, seen and lit from the inside."""
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    bowl = s.ball(s.diffuse((0.8, 0.35, 0.12)), at=(0.0, 0.0, 1.2), segments=8)
    bowl.modifiers.new("Half", "MASK").vertex_group = bowl.vertex_groups.new(name="Lower").name
    bowl.vertex_groups[0].add([vertex.index for vertex in bowl.data.vertices if vertex.co.z < 0.1], 1.0, "REPLACE")
    s.lamp("SUN", (3.0, -0.5, 2.5), 3.0, angle=0.0)
