"""Lamps with nodes: constants, other falloffs, and values that vary across the lamp."""

from __future__ import annotations

from math import radians
from typing import TYPE_CHECKING, Any

from .registry import case, each

if TYPE_CHECKING:
    from collections.abc import Callable

    import bpy

    from ..stage import Nodes, Stage

RED, GREEN, BLUE = (0.9, 0.5, 0.4), (0.5, 0.9, 0.5), (0.4, 0.5, 0.9)


def lamp(s: Stage, *where: Any, **attributes: Any) -> tuple[bpy.types.Object, Nodes]:
    """A lamp, and its empty node tree."""
    from ..stage import Nodes

    thing = s.lamp(*where, **attributes)
    return thing, Nodes(thing.data.node_tree, "ShaderNodeOutputLight")


def tinted(nodes: Nodes, color: Any, strength: Any = 1.0) -> None:
    """Link an Emission shader to the lamp's output."""
    nodes.surface(nodes.add("Emission", {"Color": color, "Strength": strength}))


def a_temperature(nodes: Nodes) -> Any:
    """A colour temperature, and arithmetic."""
    strength = nodes.add("Math", {"Value": 0.4, "Value_001": 3.0}, operation="MULTIPLY")
    return nodes.add("Emission", {"Color": nodes.add("Blackbody", {"Temperature": 2700.0}), "Strength": strength})


def a_mixture(nodes: Nodes) -> Any:
    """Emission, and closures that have no effect on a lamp."""
    share = nodes.add("Clamp", {"Value": 0.3})
    warm, cold = (nodes.add("Emission", {"Color": color, "Strength": 2.0}) for color in (RED, BLUE))
    ignored = nodes.add("AddShader", {"Shader": nodes.add("BsdfTransparent"), "Shader_001": nodes.add("BsdfDiffuse")})
    mixed = nodes.add("MixShader", {"Fac": share, "Shader": warm, "Shader_001": cold})
    return nodes.add("AddShader", {"Shader": mixed, "Shader_001": ignored})


def a_surface(nodes: Nodes) -> Any:
    """The emission of a Principled BSDF."""
    return nodes.add("BsdfPrincipled", {"Emission Color": GREEN, "Emission Strength": 1.5, "Alpha": 0.5})


def a_background(nodes: Nodes) -> Any:
    """A Background, which acts like an Emission on a lamp."""
    return nodes.add("Background", {"Color": (0.9, 0.5, 0.7)})


@each({"temperature": a_temperature, "mixture": a_mixture, "surface": a_surface, "background": a_background})
def lamp_of_a_constant(s: Stage, shader: Callable[[Nodes], Any]) -> None:
    s.set()
    nodes = lamp(s, "AREA", power=100.0, size=1.0)[1]
    nodes.surface(shader(nodes))


@each(
    {
        "point_linear": ("POINT", 50.0, "Linear", 0.0),
        "area_constant": ("AREA", 10.0, "Constant", 3.0),
        "spot_quadratic": ("SPOT", 900.0, "Quadratic", 4.0),
        "sun_linear": ("SUN", 2.0, "Linear", 2.0),  # a sun has no falloff
    },
    samples=48,
)
def lamp_falloff(s: Stage, given: tuple[str, float, str, float]) -> None:
    s.set()
    kind, power, output, smooth = given
    nodes = lamp(s, kind, power=power)[1]
    tinted(nodes, RED, (nodes.add("LightFalloff", {"Strength": 1.5, "Smooth": smooth}), output))


@case(samples=64, blind=True)
def area_with_an_image(s: Stage) -> None:
    """Light sampling, scattered rays and camera rays all find the lamp."""
    s.set()
    thing, nodes = lamp(s, "AREA", (0.5, -1.0, 4.0), 300.0, shape="ELLIPSE", size=5.0, size_y=2.5)
    thing.visible_camera, thing.scale = True, (1.2, 0.8, 1.0)
    s.aim(thing, (0.0, -6.0, 1.0))
    s.aim(s.camera, (0.0, 0.0, 1.8))
    tinted(nodes, nodes.add("TexImage", image=s.image()))


@case(samples=64)
def spots_with_an_image(s: Stage) -> None:
    """Coordinates of the image: UV in the left lamp, Normal of Texture Coordinate in the right lamp."""
    s.set()
    nodes = lamp(s, "SPOT", (-2.0, -2.0, 4.0), 1000.0, spot_size=radians(70), shadow_soft_size=0.0)[1]
    tinted(nodes, nodes.add("TexImage", image=s.image()), (nodes.add("LightPath"), "Ray Depth"))
    thing, nodes = lamp(s, "SPOT", (2.0, -2.0, 4.0), 1000.0, spot_size=radians(70), shadow_soft_size=0.1)
    thing.scale = (1.5, 1.5, 1.5)
    normal = nodes.add("Mapping", {"Vector": (nodes.add("TexCoord"), "Normal"), "Scale": (3.0, 3.0, 3.0)})
    tinted(nodes, nodes.add("TexChecker", {"Vector": normal, "Color1": RED, "Color2": BLUE, "Scale": 2.0}))


@each({"sphere": False, "soft": True}, samples=64, blind=True)
def point_by_direction(s: Stage, soft: bool) -> None:
    """Nodes of a large lamp read their inputs at the emitting point."""
    s.set()
    thing, nodes = lamp(s, "POINT", (0.3, -1.5, 2.2), 60.0, shadow_soft_size=0.6, use_soft_falloff=soft)
    thing.visible_camera = True
    coordinate, geometry = nodes.add("TexCoord"), nodes.add("NewGeometry")
    sums = nodes.add("VectorMath", {"Vector": (coordinate, "Object"), "Vector_001": (geometry, "Normal")}, operation="ADD")
    sums = nodes.add("VectorMath", {"Vector": sums, "Vector_001": (geometry, "Parametric")}, operation="ADD")
    facing = (nodes.add("LayerWeight", {"Blend": 0.3}), "Facing")
    tinted(nodes, nodes.add("VectorMath", {"Vector": sums}, operation="ABSOLUTE"), nodes.add("Math", {"Value": facing, "Value_001": 0.5}))


@case(samples=64)
def lamps_do_not_know_the_kind_of_a_ray(s: Stage) -> None:
    """The strength is 1 - (is camera ray) - (is diffuse ray). Yet the lamp is seen and lights everything."""
    s.set()
    thing, nodes = lamp(s, "POINT", (0.3, -1.5, 2.2), 60.0, shadow_soft_size=0.4)
    thing.visible_camera = True
    path = nodes.add("LightPath")
    kinds = nodes.add("Math", {"Value": (path, "Is Camera Ray"), "Value_001": (path, "Is Diffuse Ray")})
    tinted(nodes, GREEN, nodes.add("Math", {"Value": 1.0, "Value_001": kinds}, operation="SUBTRACT"))


@case(samples=64)
def sun_with_an_image(s: Stage) -> None:
    s.floor(s.material("BsdfGlossy", {"Roughness": 0.2, "Color": (0.9, 0.8, 0.7)}))
    s.ball(s.diffuse((0.7, 0.8, 0.9)))
    thing, nodes = lamp(s, "SUN", (0.7, 1.5, 2.0), 3.0, angle=radians(40))
    s.aim(thing, (0.0, -2.0, 0.0))
    tinted(nodes, nodes.add("TexImage", image=s.image()))
