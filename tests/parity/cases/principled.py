"""The Principled BSDF, input by input."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .registry import case, each

if TYPE_CHECKING:
    from ..stage import Stage

WINE = {"Base Color": (0.7, 0.25, 0.3)}
METAL = {"Base Color": (0.9, 0.7, 0.4), "Metallic": 1.0}
GLASS = {"Base Color": (0.6, 0.9, 0.8), "Transmission Weight": 1.0, "Roughness": 0.0}


@each(
    {
        "default": {},
        "smooth": WINE | {"Roughness": 0.0},
        "shiny": WINE | {"Roughness": 0.2},
        "rough": WINE | {"Roughness": 1.0},
        "diffuse_roughness": WINE | {"Diffuse Roughness": 0.8},
        "without_specular": WINE | {"Specular IOR Level": 0.0},
        "specular_level": WINE | {"Specular IOR Level": 0.9, "Roughness": 0.3},
        "specular_tint": WINE | {"Specular Tint": (0.9, 0.4, 0.2), "Roughness": 0.3},
        "ior": WINE | {"IOR": 2.2, "Roughness": 0.3},
        "ior_below_1": WINE | {"IOR": 0.8, "Roughness": 0.6},
        "anisotropic": WINE | {"Roughness": 0.4, "Anisotropic": 0.8, "Anisotropic Rotation": 0.1},
    }
)
def principled(s: Stage, inputs: dict[str, Any]) -> None:
    s.subject("BsdfPrincipled", inputs)


@each(
    {
        "mirror": METAL | {"Roughness": 0.0},
        "shiny": METAL | {"Roughness": 0.2},
        "rough": METAL | {"Roughness": 0.7},
        "specular_tint": METAL | {"Roughness": 0.3, "Specular Tint": (0.2, 0.5, 0.9)},
        "half": METAL | {"Roughness": 0.3, "Metallic": 0.5},
        "anisotropic": METAL | {"Roughness": 0.4, "Anisotropic": 0.8, "Anisotropic Rotation": 0.1},
    }
)
def principled_metal(s: Stage, inputs: dict[str, Any]) -> None:
    s.subject("BsdfPrincipled", inputs)


@each(
    {
        "clear": GLASS,
        "frosted": GLASS | {"Roughness": 0.4},
        "half": GLASS | {"Roughness": 0.3, "Transmission Weight": 0.5},
        "specular_tint": GLASS | {"Roughness": 0.3, "Specular Tint": (0.9, 0.4, 0.2)},
        "dense": GLASS | {"Roughness": 0.1, "IOR": 2.4},
        "specular_level": GLASS | {"Roughness": 0.2, "Specular IOR Level": 0.2},
    },
    samples=32,
)
def principled_transmission(s: Stage, inputs: dict[str, Any]) -> None:
    s.subject("BsdfPrincipled", inputs)


@each(
    {
        "smooth": WINE | {"Coat Weight": 1.0},
        "mirror": WINE | {"Coat Weight": 1.0, "Coat Roughness": 0.0},
        "rough": WINE | {"Coat Weight": 0.7, "Coat Roughness": 0.5},
        "tinted": WINE | {"Coat Weight": 1.0, "Coat Roughness": 0.2, "Coat Tint": (0.9, 0.6, 0.3)},
        "ior": WINE | {"Coat Weight": 1.0, "Coat Roughness": 0.2, "Coat IOR": 2.0},
        "over_metal": METAL | {"Roughness": 0.4, "Coat Weight": 1.0, "Coat Roughness": 0.1},
        "over_glass": GLASS | {"Roughness": 0.3, "Coat Weight": 1.0, "Coat Roughness": 0.3},
        "over_emission": WINE | {"Coat Weight": 1.0, "Coat Tint": (0.9, 0.6, 0.3), "Emission Strength": 0.5},
    },
    samples=32,
)
def principled_coat(s: Stage, inputs: dict[str, Any]) -> None:
    s.subject("BsdfPrincipled", inputs)


@each(
    {
        "default": WINE | {"Sheen Weight": 1.0},
        "smooth": WINE | {"Sheen Weight": 1.0, "Sheen Roughness": 0.15},
        "tinted": WINE | {"Sheen Weight": 0.7, "Sheen Roughness": 0.8, "Sheen Tint": (0.2, 0.5, 0.9)},
        "over_coat": WINE | {"Sheen Weight": 0.7, "Coat Weight": 0.5},
        "over_metal": METAL | {"Sheen Weight": 1.0, "Roughness": 0.3},
    }
)
def principled_sheen(s: Stage, inputs: dict[str, Any]) -> None:
    s.subject("BsdfPrincipled", inputs)


@each(
    {
        "half": WINE | {"Alpha": 0.5},
        "zero": WINE | {"Alpha": 0.0},
        "with_emission": WINE | {"Alpha": 0.3, "Emission Color": (0.2, 0.8, 0.3), "Emission Strength": 1.0},
        "over_glass": GLASS | {"Alpha": 0.6, "Roughness": 0.2},
    }
)
def principled_alpha(s: Stage, inputs: dict[str, Any]) -> None:
    s.subject("BsdfPrincipled", inputs)


@case()
def principled_emission(s: Stage) -> None:
    s.subject("BsdfPrincipled", WINE | {"Emission Color": (0.2, 0.8, 0.3), "Emission Strength": 1.5})


@case()
def principled_emission_under_sheen(s: Stage) -> None:
    s.subject("BsdfPrincipled", WINE | {"Emission Color": (0.2, 0.8, 0.3), "Emission Strength": 1.5, "Sheen Weight": 1.0})


@each({"plastic": WINE | {"Roughness": 0.5}, "metal": METAL | {"Roughness": 0.6}, "glass": GLASS | {"Roughness": 0.6}})
def principled_without_compensation(s: Stage, inputs: dict[str, Any]) -> None:
    s.subject("BsdfPrincipled", inputs, distribution="GGX")


@case()
def principled_everything(s: Stage) -> None:
    some = {"Metallic": 0.3, "Roughness": 0.35, "Transmission Weight": 0.4, "Coat Weight": 0.5, "Sheen Weight": 0.4, "Alpha": 0.9}
    s.subject("BsdfPrincipled", WINE | some | {"Specular IOR Level": 0.6, "Anisotropic": 0.5, "Emission Strength": 0.2})


SOCKETS = ("Metallic", "Roughness", "Transmission Weight", "Coat Weight", "Sheen Weight", "Alpha", "Specular IOR Level", "Coat Roughness")


@each({socket.lower().replace(" ", "_"): socket for socket in SOCKETS})
def principled_textured(s: Stage, socket: str) -> None:
    """The input goes from 0 to 1 over each face of the box and around the ball."""
    s.lights()
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    material, nodes = s.nodes()
    along = nodes.add("SeparateXYZ", {"Vector": (nodes.add("TexCoord"), "UV")})
    coat = {"Coat Weight": 1.0} if socket == "Coat Roughness" else {}
    nodes.surface(nodes.add("BsdfPrincipled", WINE | {"Roughness": 0.3} | coat | {socket: (along, "X")}))
    s.ball(material)
    s.box(material)
