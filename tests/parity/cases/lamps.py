"""Lamps: each kind, and each of its settings. They light diffuse surfaces, and are seen directly and in mirrors."""

from __future__ import annotations

from math import radians
from typing import TYPE_CHECKING, Any

from .registry import case, each

if TYPE_CHECKING:
    from ..stage import Stage


@each(
    {
        "of_radius_0": {"shadow_soft_size": 0.0},
        "soft": {"shadow_soft_size": 0.4},
        "sphere": {"shadow_soft_size": 0.4, "use_soft_falloff": False},
        "not_normalized": {"shadow_soft_size": 0.4, "normalize": False},
        "of_radius_0_not_normalized": {"shadow_soft_size": 0.0, "normalize": False},
    }
)
def point(s: Stage, attributes: dict[str, Any]) -> None:
    s.set()
    s.lamp("POINT", (0.6, -1.2, 1.6), 150.0, **attributes)


@each({"the_floor": (0.3, -1.3, 0.45), "the_camera": (0.0, -6.0, 3.0)}, samples=64)
def point_sphere_near(s: Stage, at: tuple[float, float, float]) -> None:
    s.set()
    s.lamp("POINT", at, 100.0, shadow_soft_size=0.3, use_soft_falloff=False)


@each({"of_0_degrees": 0.0, "of_25_degrees": 25.0, "of_120_degrees": 120.0})
def sun(s: Stage, angle: float) -> None:
    s.set()
    s.lamp("SUN", power=3.0, angle=radians(angle))


@case()
def sun_not_normalized(s: Stage) -> None:
    s.set()
    s.lamp("SUN", power=10.0, angle=radians(30), normalize=False)


@each(
    {
        "hard": {"spot_blend": 0.0, "shadow_soft_size": 0.0},
        "blended": {"spot_blend": 0.5, "shadow_soft_size": 0.0},
        "soft": {"spot_blend": 0.5, "shadow_soft_size": 0.3},
        "sphere": {"spot_blend": 0.5, "shadow_soft_size": 0.3, "use_soft_falloff": False},
        "wide": {"spot_blend": 1.0, "spot_size": radians(150), "shadow_soft_size": 0.2},
        "not_normalized": {"spot_blend": 0.2, "shadow_soft_size": 0.3, "normalize": False},
    },
    samples=64,
)
def spot(s: Stage, attributes: dict[str, Any]) -> None:
    s.set()
    s.lamp("SPOT", power=1000.0, **({"spot_size": radians(40)} | attributes))


@case(samples=64)
def spot_scaled(s: Stage) -> None:
    s.set()
    s.lamp("SPOT", power=1000.0, spot_size=radians(45), spot_blend=0.3, shadow_soft_size=0.2).scale = (2.0, 2.0, 2.0)


@each(
    {
        "square": {"shape": "SQUARE", "size": 1.5},
        "rectangle": {"shape": "RECTANGLE", "size": 2.5, "size_y": 0.5},
        "disk": {"shape": "DISK", "size": 1.5},
        "ellipse": {"shape": "ELLIPSE", "size": 2.5, "size_y": 0.7},
        "not_normalized": {"shape": "SQUARE", "size": 1.5, "normalize": False},
    }
)
def area(s: Stage, attributes: dict[str, Any]) -> None:
    s.set()
    s.lamp("AREA", **attributes)


@each(
    {"60_degrees": {"shape": "RECTANGLE", "size_y": 1.0, "spread": radians(60)}, "90_degrees": {"shape": "DISK", "spread": radians(90)}},
    samples=128,
)
def area_spread(s: Stage, attributes: dict[str, Any]) -> None:
    s.set()
    s.lamp("AREA", power=100.0, size=1.5, **attributes)


@each(
    {"square": {"shape": "SQUARE"}, "ellipse": {"shape": "ELLIPSE", "size_y": 5.0}, "spread": {"spread": radians(140)}},
    samples=64,
    blind=True,
)
def area_large(s: Stage, attributes: dict[str, Any]) -> None:
    s.set()
    s.lamp("AREA", (0.5, -2.0, 3.5), 800.0, size=7.0, **attributes)


@each({"square": {"shape": "SQUARE", "size": 1.0}, "disk": {"shape": "DISK", "size": 1.0}})
def area_scaled(s: Stage, attributes: dict[str, Any]) -> None:
    s.set()
    s.lamp("AREA", **attributes).scale = (2.5, 0.5, 3.0)


@each({"square": {"shape": "SQUARE", "size": 1.5}, "disk": {"shape": "DISK", "size": 1.5}}, samples=64)
def area_near_the_floor(s: Stage, attributes: dict[str, Any]) -> None:
    s.set()
    lamp = s.lamp("AREA", (0.3, -1.9, 0.15), 60.0, **attributes)
    lamp.rotation_euler = (0.0, 0.2, 0.0)


@case()
def area_mirrored(s: Stage) -> None:
    s.set()
    s.lamp("AREA", shape="RECTANGLE", size=2.0, size_y=0.6, spread=radians(80)).scale = (-1.0, 1.0, 1.0)


@case()
def exposure_color_and_temperature(s: Stage) -> None:
    s.set()
    s.lamp("AREA", power=60.0, size=1.5, exposure=1.5, use_temperature=True, temperature=3000.0, color=(0.9, 0.6, 0.7))


@case()
def lamp_with_nodes(s: Stage) -> None:
    from ..stage import Nodes

    s.set()
    lamp = s.lamp("AREA", power=60.0, size=1.5)
    nodes = Nodes(lamp.data.node_tree, "ShaderNodeOutputLight")
    nodes.surface(nodes.add("Emission", {"Color": (0.9, 0.5, 0.2), "Strength": 4.0}))


LAMPS = {
    "square": ("AREA", {"shape": "SQUARE", "size": 1.6}),
    "ellipse": ("AREA", {"shape": "ELLIPSE", "size": 2.2, "size_y": 1.2, "spread": radians(120)}),
    "soft_point": ("POINT", {"shadow_soft_size": 0.7}),
    "sphere": ("POINT", {"shadow_soft_size": 0.7, "use_soft_falloff": False}),
    "soft_spot": ("SPOT", {"shadow_soft_size": 0.7, "spot_size": radians(90), "spot_blend": 0.4}),
    "sphere_spot": ("SPOT", {"shadow_soft_size": 0.7, "spot_size": radians(90), "spot_blend": 0.4, "use_soft_falloff": False}),
}


@each(LAMPS, samples=64)
def seen_by_the_camera(s: Stage, lamp: tuple[str, dict[str, Any]]) -> None:
    s.set()
    kind, attributes = lamp
    thing = s.lamp(kind, (0.4, -1.5, 2.0), 60.0, **attributes)
    thing.visible_camera = True
    s.aim(thing, (0.1, -4.0, 0.0))


@case()
def sun_seen_by_the_camera(s: Stage) -> None:
    s.set()
    thing = s.lamp("SUN", (0.0, 10.0, 3.0), 1.0, angle=radians(20))
    s.aim(thing, (0.0, -6.0, 2.5))
    s.aim(s.camera, (0.0, 0.0, 2.0))
    thing.visible_camera = True


@each(LAMPS | {"sun": ("SUN", {"angle": radians(20)})}, samples=128)
def seen_in_a_mirror(s: Stage, lamp: tuple[str, dict[str, Any]]) -> None:
    s.floor(s.material("BsdfGlossy", {"Roughness": 0.0, "Color": (0.9, 0.8, 0.7)}))
    s.ball(s.material("BsdfGlossy", {"Roughness": 0.0, "Color": (0.7, 0.8, 0.9)}))
    kind, attributes = lamp
    thing = s.lamp(kind, (0.7, 1.5, 2.0), 3.0 if kind == "SUN" else 100.0, **attributes)
    s.aim(thing, (0.0, -2.0, 0.0))


@each(LAMPS | {"sun": ("SUN", {"angle": radians(20)})}, samples=128)
def on_a_glossy_floor(s: Stage, lamp: tuple[str, dict[str, Any]]) -> None:
    s.floor(s.material("BsdfGlossy", {"Roughness": 0.3, "Color": (0.9, 0.8, 0.7)}))
    s.ball(s.diffuse((0.7, 0.8, 0.9)))
    kind, attributes = lamp
    thing = s.lamp(kind, (0.7, 1.5, 2.0), 3.0 if kind == "SUN" else 100.0, **attributes)
    s.aim(thing, (0.0, -2.0, 0.0))


@case()
def shadow_off(s: Stage) -> None:
    s.set()
    s.lamp("AREA", size=1.0, use_shadow=False)


@case()
def shadow_off_beside_a_lamp_with_shadow(s: Stage) -> None:
    s.set()
    s.lamp("POINT", (-2.0, -2.0, 3.0), shadow_soft_size=0.3, use_shadow=False)
    s.lamp("AREA", size=1.0)


@each({"diffuse": "visible_diffuse", "glossy": "visible_glossy", "transmission": "visible_transmission"}, samples=128)
def lamp_hidden_from(s: Stage, switch: str) -> None:
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(s.material("BsdfGlossy", {"Roughness": 0.5}))
    s.box(s.material("BsdfTranslucent", {"Color": (0.6, 0.7, 0.8)}))
    s.lamp("AREA", (2.5, 2.0, 3.5), size=3.0)
    setattr(s.lamp("AREA", (-2.5, -2.0, 3.5), 150.0, size=3.0), switch, False)


@case(samples=64)
def lamp_without_multiple_importance(s: Stage) -> None:
    s.floor(s.material("BsdfGlossy", {"Roughness": 0.4}))
    s.ball(s.diffuse((0.8, 0.35, 0.12)))
    s.lamp("AREA", (0.7, 1.5, 2.0), 100.0, size=1.0).data.cycles.use_multiple_importance_sampling = False


@case(samples=200)
def many_lamps(s: Stage) -> None:
    s.set()
    for i in range(40):
        x, y = 2.5 * ((i * 0.618) % 1) - 1.25, 3.5 * ((i * 0.414) % 1) - 2.5
        kind = ("POINT", "SPOT", "AREA")[i % 3]
        lamp = s.lamp(kind, (2 * x, y, 2.2 + (i % 5) / 4), 2.0 + 4 * (i % 7))
        lamp.data.color = ((i % 4) / 3, (i % 3) / 2, (i % 5) / 4)
