"""Sky textures as the world: a picture of the sky, and a sun's disc that light sampling knows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .registry import case

if TYPE_CHECKING:
    import bpy

    from ..stage import Nodes, Stage


def sky(nodes: Nodes, inputs: dict[str, Any] | None = None, **settings: Any) -> bpy.types.Node:
    """A sky with its sun in front of the camera, to the right."""
    return nodes.add("TexSky", inputs, **({"sun_elevation": 0.7, "sun_rotation": 0.4} | settings))


def alone(s: Stage, strength: float = 0.1, **settings: Any) -> None:
    nodes = s.sky((0.0, 0.0, 0.0))
    nodes.surface(nodes.add("Background", {"Color": sky(nodes, **settings), "Strength": strength}))


@case(samples=64)
def sky_with_a_large_sun(s: Stage) -> None:
    s.set()
    alone(s, sun_size=0.2)


@case()
def sky_with_a_small_sun(s: Stage) -> None:
    s.set()
    alone(s, 0.02, sky_type="SINGLE_SCATTERING", sun_elevation=2.5)


@case(blind=True)
def sky_without_a_sun(s: Stage) -> None:
    s.set()
    alone(s, 1.0, sky_type="HOSEK_WILKIE", sun_direction=(0.2, 0.8, 0.5), turbidity=4.0)


@case(samples=64)
def sky_turned_and_mixed(s: Stage) -> None:
    """Camera rays see one sky, other rays see another sky, with other coordinates and a second sun."""
    s.set()
    nodes = s.sky((0.0, 0.0, 0.0))
    coordinates = nodes.add("TexCoord")
    turned = nodes.add("Mapping", {"Vector": (coordinates, "Generated"), "Rotation": (0.3, -0.5, 1.0)})
    seen = sky(nodes, sky_type="HOSEK_WILKIE", sun_direction=(0.0, 0.6, 0.8))
    lit = nodes.add(
        "Mix",
        {"Factor_Float": 0.3, "A_Color": sky(nodes, {"Vector": turned}, sun_size=0.3), "B_Color": sky(nodes, sun_size=0.2)},
        data_type="RGBA",
    )
    lights = nodes.add("Background", {"Color": (lit, "Result_Color"), "Strength": 0.05})
    ray = nodes.add("LightPath")
    nodes.surface(
        nodes.add("MixShader", {"Fac": (ray, "Is Camera Ray"), "Shader": lights, "Shader_001": nodes.add("Background", {"Color": seen})})
    )


@case(samples=64)
def sky_that_is_stretched(s: Stage) -> None:
    s.set()
    nodes = s.sky((0.0, 0.0, 0.0))
    coordinates = nodes.add("TexCoord")
    mapped = nodes.add("Mapping", {"Vector": (coordinates, "Generated"), "Scale": (1.0, 1.2, 1.0)})
    nodes.surface(nodes.add("Background", {"Color": sky(nodes, {"Vector": mapped}, sun_size=0.5), "Strength": 0.1}))


@case(samples=64)
def sky_on_a_surface(s: Stage) -> None:
    """Coordinates that are not unit vectors."""
    material, nodes = s.nodes()
    nodes.surface(nodes.add("Emission", {"Color": sky(nodes, sun_size=0.4, sun_intensity=0.05), "Strength": 0.1}))
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(material)
