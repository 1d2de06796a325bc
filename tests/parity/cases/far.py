"""Rounding of positions: scenes far from the origin, thin walls, objects that almost touch."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .registry import case, each

if TYPE_CHECKING:
    from ..stage import Stage


@each({"500_m": 500.0, "5_km": 5000.0, "100_km": 100000.0})
def far(s: Stage, x: float) -> None:
    """Glass, a box 1 mm above the floor, and a pattern in world and object coordinates."""
    material, nodes = s.nodes()
    world = nodes.add("TexChecker", {"Vector": (nodes.add("NewGeometry"), "Position"), "Scale": 0.7})
    own = nodes.add("TexChecker", {"Vector": (nodes.add("TexCoord"), "Object"), "Scale": 2.3})
    nodes.surface(nodes.add("BsdfDiffuse", {"Color": nodes.add("Mix", {"A_Color": world, "B_Color": own}, data_type="RGBA")}))
    s.lights()
    s.floor(material)
    s.ball(s.material("BsdfGlass", {"IOR": 1.5}))
    s.box(material, at=(1.3, 0.2, 0.701))
    for thing in s.scene.objects:
        thing.location.x += x


@case()
def thin_walls(s: Stage) -> None:
    """A hollow glass ball, 7 m away, with a wall of 0.05 mm: a bubble. If rays miss one surface, the ball acts as a lens."""
    s.lights()
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    glass = s.material("BsdfGlass", {"IOR": 1.5})
    s.ball(glass)
    s.ball(glass, scale=(0.99995,) * 3).data.flip_normals()
    s.box(s.diffuse((0.8, 0.35, 0.12)))
