"""All shader nodes except the Principled BSDF, on a ball and a box over a diffuse floor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .registry import case, each

if TYPE_CHECKING:
    from ..stage import Stage

COPPER = (0.9, 0.6, 0.4)
MINT = (0.5, 0.9, 0.7)


@each({"smooth": 0.0, "rough": 0.5, "very_rough": 1.0})
def diffuse(s: Stage, roughness: float) -> None:
    s.subject("BsdfDiffuse", {"Color": COPPER, "Roughness": roughness})


@each(
    {
        f"{name}_{distribution.lower()}": (distribution, roughness)
        for distribution in ("GGX", "MULTI_GGX")
        for name, roughness in {"mirror": 0.0, "shiny": 0.2, "rough": 0.6, "very_rough": 1.0}.items()
    }
)
def glossy(s: Stage, variant: tuple[str, float]) -> None:
    distribution, roughness = variant
    s.subject("BsdfAnisotropic", {"Color": COPPER, "Roughness": roughness}, distribution=distribution)


@each({"along": (0.7, 0.0), "turned": (0.7, 0.15), "across": (-0.6, 0.0)})
def anisotropic(s: Stage, variant: tuple[float, float]) -> None:
    anisotropy, rotation = variant
    s.subject("BsdfAnisotropic", {"Color": COPPER, "Roughness": 0.4, "Anisotropy": anisotropy, "Rotation": rotation}, distribution="GGX")


@each(
    {
        "clear": (0.0, 1.5, "GGX"),
        "frosted": (0.3, 1.5, "GGX"),
        "frosted_multi_ggx": (0.5, 1.5, "MULTI_GGX"),
        "of_ior_below_1": (0.2, 0.8, "MULTI_GGX"),
    },
    samples=32,
)
def glass(s: Stage, variant: tuple[float, float, str]) -> None:
    roughness, ior, distribution = variant
    s.subject("BsdfGlass", {"Color": MINT, "Roughness": roughness, "IOR": ior}, distribution=distribution)


@each({"very_rough": (0.8, 1.3), "of_ior_1": (0.3, 1.0)}, samples=96)
def glass_lit_by_chance(s: Stage, variant: tuple[float, float]) -> None:
    """Glass in light that Cycles does not sample.

    When Cycles evaluates rough glass for sampled light, microfacets that face away transmit, too. When Cycles samples rough glass, they do
    not. So in Cycles very rough glass is 1 % brighter with next-event estimation than without.
    """
    roughness, ior = variant
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    glass = s.material("BsdfGlass", {"Color": MINT, "Roughness": roughness, "IOR": ior}, distribution="GGX")
    s.ball(glass)
    s.box(glass)
    glow = s.glow((1.0, 1.0, 1.0), 6.0)
    glow.cycles.emission_sampling = "NONE"
    s.aim(s.floor(glow, size=5.0, location=(2.0, -2.5, 4.5)), (0.0, 0.0, 0.5))
    s.sky((0.3, 0.4, 0.55))
    s.scene.world.cycles.sampling_method = "NONE"


@each({"clear": 0.0, "frosted": 0.4})
def refraction(s: Stage, roughness: float) -> None:
    s.subject("BsdfRefraction", {"Color": MINT, "Roughness": roughness, "IOR": 1.4}, distribution="GGX")


@case()
def translucent(s: Stage) -> None:
    s.subject("BsdfTranslucent", {"Color": MINT})


@each({"clear": (1.0, 1.0, 1.0), "colored": (0.9, 0.5, 0.3), "black": (0.0, 0.0, 0.0)})
def transparent(s: Stage, color: tuple[float, float, float]) -> None:
    s.subject("BsdfTransparent", {"Color": color})


@case()
def transparent_before_a_small_lamp(s: Stage) -> None:
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(s.material("BsdfTransparent", {"Color": (0.9, 0.5, 0.3)}))
    s.box(s.material("BsdfTransparent", {"Color": (0.5, 0.6, 0.9)}))
    s.lamp("POINT", shadow_soft_size=0.1)


@each({"half": 0.5, "mostly_the_second": 0.85})
def mix_shader(s: Stage, factor: float) -> None:
    material, nodes = s.nodes()
    first, second = nodes.add("BsdfDiffuse", {"Color": MINT}), nodes.add("BsdfAnisotropic", {"Color": COPPER, "Roughness": 0.2})
    nodes.surface(nodes.add("MixShader", {"Fac": factor, "Shader": first, "Shader_001": second}))
    show(s, material)


@case()
def add_shader(s: Stage) -> None:
    material, nodes = s.nodes()
    first, second = nodes.add("BsdfDiffuse", {"Color": (0.3, 0.4, 0.3)}), nodes.add("BsdfTranslucent", {"Color": (0.4, 0.2, 0.1)})
    glow = nodes.add("Emission", {"Color": (0.2, 0.1, 0.3)})
    both = nodes.add("AddShader", {"Shader": first, "Shader_001": second})
    nodes.surface(nodes.add("AddShader", {"Shader": both, "Shader_001": glow}))
    show(s, material)


@case()
def mix_with_transparent(s: Stage) -> None:
    material, nodes = s.nodes()
    first, second = nodes.add("BsdfTransparent"), nodes.add("BsdfDiffuse", {"Color": COPPER})
    nodes.surface(nodes.add("MixShader", {"Fac": 0.6, "Shader": first, "Shader_001": second}))
    show(s, material)


@case()
def mix_of_nothing(s: Stage) -> None:
    material, nodes = s.nodes()
    nodes.surface(nodes.add("MixShader", {"Fac": 0.3, "Shader": nodes.add("BsdfDiffuse", {"Color": COPPER})}))
    show(s, material)


@each({"smooth": 0.1, "half": 0.5, "rough": 1.0})
def sheen(s: Stage, roughness: float) -> None:
    s.subject("BsdfSheen", {"Color": COPPER, "Roughness": roughness}, distribution="MICROFIBER")


@each(
    {
        "mirror": {"Roughness": 0.0},
        "rough": {"Roughness": 0.4},
        "edge_tinted": {"Roughness": 0.2, "Edge Tint": (0.2, 0.5, 0.9)},
        "anisotropic": {"Roughness": 0.4, "Anisotropy": 0.7, "Rotation": 0.1},
    }
)
def metallic(s: Stage, inputs: dict[str, Any]) -> None:
    s.subject("BsdfMetallic", inputs, fresnel_type="F82")


@case()
def metallic_without_compensation(s: Stage) -> None:
    s.subject("BsdfMetallic", {"Roughness": 0.7}, fresnel_type="F82", distribution="GGX")


@case()
def no_material(s: Stage) -> None:
    s.lights()
    s.floor()
    s.ball()
    s.box()


@case()
def no_surface(s: Stage) -> None:
    s.lights()
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(s.nodes()[0])


@case()
def color_above_1(s: Stage) -> None:
    s.sky((0.3, 0.4, 0.5))
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(s.diffuse((1.3, 0.8, 0.5)))


def show(s: Stage, material: Any) -> None:
    """Like `Stage.subject`, but with a given material."""
    s.lights()
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(material)
    s.box(material)
