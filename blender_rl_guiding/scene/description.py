"""What a scene bundle says in words and numbers: camera, film, lamps, shaders, and what could not be taken over.

Standard library only, because the add-on writes these inside Blender's own Python (3.11 or newer).
World space is Blender's: right-handed, z up, metres. Colours are linear Rec. 709.
"""

from dataclasses import dataclass, field

Color = tuple[float, float, float]
Matrix = tuple[tuple[float, ...], ...]  # 4 x 4, rows

# Kinds of rays that an object or a light may be hidden from; a visibility is a sum of these.
CAMERA, DIFFUSE, GLOSSY, TRANSMISSION, SHADOW = 1, 2, 4, 8, 16
VISIBLE = CAMERA | DIFFUSE | GLOSSY | TRANSMISSION | SHADOW

IDENTITY: Matrix = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Loss:
    """One thing of the scene that the bundle could not take over: a line of the coverage report."""

    object: str  # name of the object, or of the world or scene
    where: str  # "material 'Glass', node 'Glass BSDF'"; empty for the object as a whole
    detail: str  # what is lost, and what stands in its place


# --- camera and film -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Camera:
    """Looks along -z of `to_world` with +y up, as Blender's cameras do; pixel (0, 0) is at the top left."""

    to_world: Matrix  # the upper 3 x 3 is a rotation
    window: tuple[float, float, float, float]  # left, right, bottom, top of the image at distance 1; orthographic: in metres
    width: int  # pixels
    height: int
    # perspective, orthographic, or panorama: equirectangular, the window in radians of longitude and latitude; or hemisphere: looks
    # along +z, x of the window is the turn around it, 0..1, and y the cosine to it, so that all pixels are of one solid angle.
    kind: str = "perspective"
    near: float = 0.0  # clip distances along the view axis; along the ray for panoramas and hemispheres
    far: float = float("inf")
    aperture: float = 0.0  # radius of the lens in metres; 0 has everything in focus
    focus: float = 1.0  # distance of the plane in focus, metres
    blades: int = 0  # corners of the aperture; 0 makes it round
    blade_rotation: float = 0.0  # radians
    aperture_ratio: float = 1.0  # above 1 the lens is narrower from side to side: anamorphic


@dataclass(frozen=True)
class Film:
    """How samples become pixels."""

    filter: str = "box"  # box, gaussian, blackman_harris: Cycles' own
    filter_width: float = 1.0  # pixels; a box is always 1 wide
    exposure: float = 1.0  # factor on the image
    transparent: bool = False  # the world is not seen by the camera; the image has an alpha channel


@dataclass(frozen=True)
class Bounces:
    """Limits of scattering events, counted as `max_bounces` is: after reaching one of them a path scatters no more."""

    total: int = 13
    diffuse: int = 5
    glossy: int = 5
    transmission: int = 13
    transparent: int = 8  # passages through transparent surfaces, which are not counted otherwise
    roulette: int = 0  # scattering events before Russian roulette begins


# --- lamps -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Lamp:
    """A light that is not part of a mesh. Shines along -z of `to_world`."""

    name: str
    kind: str  # point, spot, sun, area
    to_world: Matrix
    # point, spot: radiant intensity, W/sr, before the spot's cone; sun: irradiance, W/m^2; area: the radiance that it would have with a
    # spread of pi
    emission: Color
    radius: float = 0.0  # point, spot: metres; sun: half of its angle, radians
    soft: bool = True  # point, spot: a disc that turns towards whatever it lights, not a sphere
    cone: float = 0.0  # spot: half of its angle, radians
    blend: float = 0.0  # spot: softness of the cone's edge, 0..1
    width: float = 0.0  # area: metres along x of to_world (whose axes have unit length)
    height: float = 0.0  # area: metres along y
    ellipse: bool = False  # area: an ellipse of these diameters, not a rectangle
    spread: float = 3.141592653589793  # area: angle of the cone that it shines into, radians; pi is Lambert's, 0 a beam
    visibility: int = VISIBLE & ~CAMERA
    shadow: bool = True  # whether things stand in its way
    mis: bool = True  # whether it can be hit by rays, and not only sampled
    shader: int = -1  # index of the scene's shaders, whose emission the lamp's is multiplied by; -1 for none


# --- shaders ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Node:
    """The value of an instruction, by its place in the shader's code."""

    index: int


Value = float | Color | Node


@dataclass(frozen=True)
class Instruction:
    """One step of a shader's code: a number or three, from inputs and earlier steps. See `ops` for what there is."""

    op: str
    inputs: tuple[Value, ...] = ()
    mode: str = ""  # which of the op's variants: "ADD"
    options: tuple[int, ...] = ()  # whole numbers that are never computed: index of a texture, table or attribute, flags


@dataclass(frozen=True)
class Closure:
    """A reflection, transmission or emission that a shader adds to its surface, with its inputs by name (see `CLOSURES`)."""

    kind: str
    weight: Value  # factor on it: product of the Mix Shaders' shares above it
    inputs: dict[str, Value] = field(default_factory=dict)

    def __post_init__(self) -> None:
        unknown = self.inputs.keys() - CLOSURES[self.kind].keys()
        assert not unknown, f"{self.kind} has no input {unknown}"


@dataclass(frozen=True)
class Shader:
    """What a surface or the world does with light."""

    name: str
    code: tuple[Instruction, ...] = ()
    closures: tuple[Closure, ...] = ()


# The inputs of each closure with the values that they have where none is given. None for a normal is the surface's own (in the
# code's terms: shading normal), for a tangent the one that Cycles makes up. Inputs mean what Blender's sockets of these names mean.
CLOSURES: dict[str, dict[str, Value | None]] = {
    "diffuse": {"color": (0.8, 0.8, 0.8), "roughness": 0.0, "normal": None},
    "translucent": {"color": (0.8, 0.8, 0.8), "normal": None},
    "transparent": {"color": (1.0, 1.0, 1.0)},
    "emission": {"color": (1.0, 1.0, 1.0), "strength": 1.0},  # of a surface, or the world's Background
    "glossy": {
        "color": (0.8, 0.8, 0.8), "roughness": 0.5, "anisotropy": 0.0, "rotation": 0.0, "multiscatter": 1.0,
        "normal": None, "tangent": None,
    },
    "metallic": {  # F82-tint
        "base_color": (0.617, 0.577, 0.54), "edge_tint": (0.695, 0.726, 0.77), "roughness": 0.5, "anisotropy": 0.0, "rotation": 0.0,
        "multiscatter": 1.0, "normal": None, "tangent": None,
    },
    "glass": {"color": (1.0, 1.0, 1.0), "roughness": 0.0, "ior": 1.5, "multiscatter": 1.0, "normal": None},
    "refraction": {"color": (1.0, 1.0, 1.0), "roughness": 0.0, "ior": 1.45, "normal": None},
    "sheen": {"color": (0.8, 0.8, 0.8), "roughness": 0.5, "normal": None},
    "principled": {
        "base_color": (0.8, 0.8, 0.8), "metallic": 0.0, "roughness": 0.5, "ior": 1.5, "alpha": 1.0, "normal": None,
        "diffuse_roughness": 0.0, "specular_ior_level": 0.5, "specular_tint": (1.0, 1.0, 1.0), "anisotropic": 0.0,
        "anisotropic_rotation": 0.0, "tangent": None, "transmission": 0.0,
        "coat_weight": 0.0, "coat_roughness": 0.03, "coat_ior": 1.5, "coat_tint": (1.0, 1.0, 1.0), "coat_normal": None,
        "sheen_weight": 0.0, "sheen_roughness": 0.5, "sheen_tint": (1.0, 1.0, 1.0),
        "emission_color": (1.0, 1.0, 1.0), "emission_strength": 0.0, "multiscatter": 1.0,
    },
}  # fmt: skip


def emits(closure: Closure) -> bool:
    """Whether a closure may emit."""
    if closure.kind == "emission":
        parts = (closure.weight, closure.inputs.get("color", 1.0), closure.inputs.get("strength", 1.0))
    elif closure.kind == "principled":
        parts = (closure.weight, closure.inputs.get("emission_color", 1.0), closure.inputs.get("emission_strength", 0.0))
    else:
        return False
    return all(isinstance(part, Node) or any(part if isinstance(part, tuple) else (part,)) for part in parts)
