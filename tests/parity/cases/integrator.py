"""The ends of paths, and the film."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .registry import case, each

if TYPE_CHECKING:
    from ..stage import Stage


def corridor(s: Stage, shader: str, **inputs: float) -> None:
    """Two bright walls face each other under the sky, with a ball between them."""
    s.sky((0.5, 0.6, 0.8))
    s.lamp("AREA", (0.0, -1.0, 4.5), size=4.0)
    s.floor(s.diffuse((0.7, 0.7, 0.7)))
    for x, angle in ((-1.9, 1.45), (1.9, -1.5)):
        s.floor(s.material(shader, {"Color": (0.9, 0.8, 0.7)} | inputs), size=4.0, location=(x, 0.0, 1.5), rotation_euler=(0.0, angle, 0.0))
    s.ball(s.diffuse((0.8, 0.35, 0.12)), at=(0.0, 0.3, 1.0))


@each({str(limit): limit for limit in (0, 1, 2, 5)})
def max_bounces(s: Stage, limit: int) -> None:
    corridor(s, "BsdfDiffuse")
    s.scene.cycles.max_bounces = limit


@each({str(limit): limit for limit in (0, 1, 2)})
def diffuse_bounces(s: Stage, limit: int) -> None:
    corridor(s, "BsdfDiffuse")
    s.scene.cycles.diffuse_bounces = limit


@each({str(limit): limit for limit in (0, 1, 2)}, samples=32)
def glossy_bounces(s: Stage, limit: int) -> None:
    corridor(s, "BsdfAnisotropic", Roughness=0.2)
    s.scene.cycles.glossy_bounces = limit


@each({str(limit): limit for limit in (0, 1, 2, 3)}, samples=32)
def mirror_bounces(s: Stage, limit: int) -> None:
    corridor(s, "BsdfAnisotropic", Roughness=0.0)
    s.scene.cycles.glossy_bounces = limit


@each({str(limit): limit for limit in (0, 1, 2, 3)})
def transmission_bounces(s: Stage, limit: int) -> None:
    s.subject("BsdfRefraction", {"Color": (0.5, 0.9, 0.7), "Roughness": 0.3, "IOR": 1.3}, distribution="GGX")
    s.scene.cycles.transmission_bounces = limit


@each({str(limit): limit for limit in (0, 1, 2)})
def translucent_bounces(s: Stage, limit: int) -> None:
    s.subject("BsdfTranslucent", {"Color": (0.5, 0.9, 0.7)})
    s.scene.cycles.transmission_bounces = limit


@each({str(limit): limit for limit in (0, 1, 2, 3)})
def transparent_bounces(s: Stage, limit: int) -> None:
    """Three panes in front of the camera, and a lamp above three more."""
    s.set()
    s.sky((0.3, 0.3, 0.4))
    pane = s.material("BsdfTransparent", {"Color": (0.9, 0.8, 0.7)})
    for k in range(3):
        s.floor(pane, size=2.0, location=(-1.0, -2.0 - 0.3 * k, 1.6), rotation_euler=(1.2, 0.0, 0.0))
        s.floor(pane, size=2.0, location=(1.2, -1.0, 2.2 + 0.2 * k))
    s.lamp("POINT", shadow_soft_size=0.1)
    s.scene.cycles.transparent_max_bounces = limit


@case()
def few_bounces_with_emitters(s: Stage) -> None:
    corridor(s, "BsdfDiffuse")
    s.floor(s.glow((1.0, 0.8, 0.6), 6.0), size=1.0, location=(0.0, -1.5, 2.8), rotation_euler=(0.4, 2.9, 0.0))
    s.scene.cycles.max_bounces = 1


@case()
def few_bounces_with_a_lamp_in_a_mirror(s: Stage) -> None:
    corridor(s, "BsdfAnisotropic", Roughness=0.1)
    s.scene.cycles.max_bounces = 1


@case()
def late_roulette(s: Stage) -> None:
    corridor(s, "BsdfDiffuse")
    s.scene.cycles.min_light_bounces = s.scene.cycles.min_transparent_bounces = 4


@case(samples=96)
def transparent_film(s: Stage) -> None:
    s.box(s.diffuse((0.15, 0.35, 0.75)))
    s.ball(s.material("BsdfPrincipled", {"Base Color": (0.7, 0.25, 0.3), "Alpha": 0.5}))
    s.lights()
    s.scene.render.film_transparent = True


@case()
def transparent_film_through_glass(s: Stage) -> None:
    s.box(s.material("BsdfTransparent", {"Color": (0.9, 0.5, 0.3)}))
    s.ball(s.material("BsdfRefraction", {"Roughness": 0.0, "IOR": 1.2}, distribution="GGX"))
    s.lights()
    s.scene.render.film_transparent = True


@case()
def film_exposure(s: Stage) -> None:
    s.set()
    s.lamp("AREA", size=1.5)
    s.scene.cycles.film_exposure = 2.5
