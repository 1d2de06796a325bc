"""Light without lamps: meshes that emit, and the world."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .registry import case, each

if TYPE_CHECKING:
    from ..stage import Nodes, Stage


@case(samples=192, blind=True)
def mesh_emitter(s: Stage) -> None:
    s.set()
    s.floor(s.glow((1.0, 0.8, 0.6), 4.0), size=5.0, location=(1.0, -2.0, 4.5), rotation_euler=(0.4, 2.9, 0.0))


@case(samples=128)
def mesh_emitter_with_two_sides(s: Stage) -> None:
    s.set()
    s.floor(s.glow((1.0, 0.8, 0.6), 5.0), size=1.4, location=(0.2, -0.6, 0.8), rotation_euler=(0.0, 1.4, 0.0))


@case(samples=128)
def mesh_emitter_that_is_a_ball(s: Stage) -> None:
    s.set()
    s.ball(s.glow((1.0, 0.8, 0.6), 10.0), at=(1.0, -1.5, 3.5), scale=(1.0, 1.0, 1.0))


@case(samples=64)
def mesh_emitter_small(s: Stage) -> None:
    s.set()
    s.floor(s.glow((1.0, 0.8, 0.6), 500.0), size=0.2, location=(0.8, -1.5, 4.0), rotation_euler=(0.2, 3.0, 0.0))


@case(samples=192, blind=True)
def mesh_emitter_with_a_texture(s: Stage) -> None:
    s.set()
    material, nodes = s.nodes()
    texture = nodes.add("TexImage", image=s.image(), interpolation="Closest")
    nodes.surface(nodes.add("Emission", {"Color": texture, "Strength": 5.0}))
    s.floor(material, size=5.0, location=(0.6, -2.0, 4.0), rotation_euler=(0.3, 2.9, 0.0))


@case(samples=160)
def mesh_emitter_that_is_mostly_dark(s: Stage) -> None:
    s.set()
    material, nodes = s.nodes()
    coordinates = nodes.add("TexCoord")
    spot = nodes.add("Math", {"Value": (coordinates, "UV"), "Value_001": 0.45}, operation="GREATER_THAN")
    nodes.surface(
        nodes.add(
            "Emission", {"Color": (1.0, 0.9, 0.7), "Strength": nodes.add("Math", {"Value": spot, "Value_001": 60.0}, operation="MULTIPLY")}
        )
    )
    s.floor(material, size=5.0, location=(0.6, -2.0, 4.0), rotation_euler=(0.3, 2.9, 0.0))


@case(samples=64)
def mesh_emitter_that_reflects(s: Stage) -> None:
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(s.material("BsdfPrincipled", {"Base Color": (0.2, 0.7, 0.3), "Emission Color": (0.9, 0.4, 0.1), "Emission Strength": 2.0}))
    s.box(s.material("BsdfPrincipled", {"Base Color": (0.8, 0.8, 0.8), "Roughness": 0.6}))


@case(samples=64)
def emission_not_sampled(s: Stage) -> None:
    s.set()
    glow = s.glow((1.0, 0.8, 0.6), 6.0)
    glow.cycles.emission_sampling = "NONE"
    s.floor(glow, size=6.0, location=(0.5, -1.0, 3.5))


@each({"front": "FRONT", "back": "BACK"}, samples=128)
def emission_sampled_on_one_side(s: Stage, side: str) -> None:
    s.set()
    s.sky((0.2, 0.2, 0.3))
    glow = s.glow((1.0, 0.8, 0.6), 2.0)
    glow.cycles.emission_sampling = side
    s.floor(glow, size=3.0, location=(0.3, -0.2, 1.0), rotation_euler=(0.0, 1.4, 0.0))


@case(blind=True)
def world_color(s: Stage) -> None:
    s.set()
    s.sky((0.4, 0.6, 0.9), 1.5)


@case()
def no_world(s: Stage) -> None:
    s.set()
    s.lamp("AREA", size=1.5)
    s.scene.world = None


def sunny_sky(s: Stage, nodes: Nodes, sun: float, rotation: tuple[float, float, float], **options: str) -> None:
    """A turned panorama of 32 x 16 texels with random colours. One texel is a sun."""
    image = s.image(32, 16, "Linear Rec.709", float_buffer=True)
    texels = np.array(image.pixels, np.float32).reshape(16, 32, 4)
    texels[..., 3] = 1.0
    texels[12, 21, :3] = sun, 0.9 * sun, 0.7 * sun
    image.pixels.foreach_set(texels.ravel())
    image.pack()
    coordinates = nodes.add("TexCoord")
    mapping = nodes.add("Mapping", {"Vector": (coordinates, "Generated"), "Rotation": rotation})
    texture = nodes.add("TexEnvironment", {"Vector": mapping}, image=image, **options)
    nodes.surface(nodes.add("Background", {"Color": texture, "Strength": 0.8}))


@case(blind=True)
def world_image(s: Stage) -> None:
    s.set()
    sunny_sky(s, s.sky((0.0, 0.0, 0.0)), 1.0, (0.0, 0.0, 1.2))


@each({"as_it_is": (0.0, 0.0, 0.0), "turned": (0.0, 0.0, 1.2), "tilted": (0.3, -0.4, 2.5)})
def world_image_with_a_sun(s: Stage, rotation: tuple[float, float, float]) -> None:
    s.set()
    sunny_sky(s, s.sky((0.0, 0.0, 0.0)), 60.0, rotation)


@each({"closest": {"interpolation": "Closest"}, "mirror_ball": {"projection": "MIRROR_BALL"}})
def world_image_by(s: Stage, options: dict[str, str]) -> None:
    s.aim(s.camera, (0.0, 0.0, 2.5))
    s.set()
    sunny_sky(s, s.sky((0.0, 0.0, 0.0)), 10.0, (0.0, 0.0, 0.5), **options)


@case()
def world_image_in_a_mirror(s: Stage) -> None:
    s.floor(s.material("BsdfGlossy", {"Roughness": 0.1}))
    s.ball(s.material("BsdfGlossy", {"Roughness": 0.0}))
    sunny_sky(s, s.sky((0.0, 0.0, 0.0)), 5.0, (0.0, 0.0, 1.2))


@case()
def world_gradient(s: Stage) -> None:
    s.set()
    nodes = s.sky((0.0, 0.0, 0.0))
    direction = nodes.add("SeparateXYZ", {"Vector": (nodes.add("TexCoord"), "Generated")})
    ramp = nodes.add("ValToRGB", {"Fac": (direction, "Z")})
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.9, 0.5, 0.2, 1.0), (0.1, 0.3, 1.0, 1.0)
    nodes.surface(nodes.add("Background", {"Color": ramp, "Strength": 1.0}))


@case(losses=("Gabor Texture is not supported: a picture of it stands in",))
def world_of_a_node_that_is_not_supported(s: Stage) -> None:
    """A picture stands in for the unsupported node. The nodes after it are evaluated as usual."""
    s.set()
    nodes = s.sky((0.0, 0.0, 0.0))
    pattern = nodes.add("TexGabor", {"Scale": 2.0})
    tinted = nodes.add(
        "Mix", {"Factor_Float": (pattern, "Value"), "A_Color": (0.1, 0.3, 0.9), "B_Color": (0.9, 0.5, 0.2)}, data_type="RGBA"
    )
    nodes.surface(nodes.add("Background", {"Color": (tinted, "Result_Color"), "Strength": 0.8}))


@case()
def world_seen_by_the_camera_only(s: Stage) -> None:
    s.set()
    s.lamp("AREA", size=1.5)
    nodes = s.sky((0.0, 0.0, 0.0))
    seen = (nodes.add("LightPath"), "Is Camera Ray")
    nodes.surface(nodes.add("Background", {"Color": (0.3, 0.5, 0.9), "Strength": seen}))
    s.aim(s.camera, (0.0, 0.0, 2.0))


@each({"camera": "camera", "diffuse": "diffuse", "glossy": "glossy", "transmission": "transmission"}, samples=48)
def world_hidden_from(s: Stage, kind: str) -> None:
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(s.material("BsdfGlossy", {"Roughness": 0.2}))
    s.box(s.material("BsdfRefraction", {"Color": (0.6, 0.7, 0.8), "Roughness": 0.0, "IOR": 1.1}))
    s.lamp("AREA", size=1.5, power=100.0)
    s.sky((0.4, 0.6, 0.9))
    setattr(s.scene.world.cycles_visibility, kind, False)


@each({"diffuse": "diffuse", "transmission": "transmission"})
def world_hidden_from_translucent_as(s: Stage, kind: str) -> None:
    """Light through a translucent surface is diffuse and transmitted. Such rays see the world only if it is visible to both kinds."""
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.box(s.material("BsdfTranslucent", {"Color": (0.6, 0.7, 0.8)}))
    s.lamp("AREA", size=1.5, power=100.0)
    s.sky((0.4, 0.6, 0.9))
    setattr(s.scene.world.cycles_visibility, kind, False)


@case(samples=64)
def world_and_lamps_and_emitters(s: Stage) -> None:
    s.set()
    s.sky((0.4, 0.6, 0.9), 0.3)
    s.lamp("AREA", (-2.0, -2.0, 3.0), 80.0, size=1.0)
    s.lamp("SUN", power=0.7, angle=0.2)
    s.floor(s.glow((1.0, 0.5, 0.3), 10.0), size=0.6, location=(0.5, -1.5, 1.0), rotation_euler=(1.2, 0.0, 0.3))
