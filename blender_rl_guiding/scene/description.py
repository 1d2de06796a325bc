"""The part of a scene bundle that is not arrays: camera, film, lamps, shaders, and the coverage report.

Standard library only, because the add-on makes these objects inside Blender's own Python (3.11 or newer).
World space is Blender's: right-handed, z up, metres. Colours are linear Rec. 709.
"""

from dataclasses import dataclass, field
from typing import Annotated, Literal

from ..typed import Length, MalformedError, Range

# Numbers with the limits of single precision. `typed.read` checks them when a bundle is read, `faults` when a bundle is written.
LARGEST = 3.4028234663852886e38
SMALLEST = 2.0**-126
MOST = 2**31 - 1  # largest count of anything: kernels count in 32 bits
FARTHEST = 1e18  # metres from 0: Embree finds nothing that is further away

Real = Annotated[float, Range(-LARGEST, LARGEST)]
Size = Annotated[float, Range(0.0, LARGEST)]
Positive = Annotated[float, Range(SMALLEST, LARGEST)]
Count = Annotated[int, Range(0, MOST)]
Limit = Annotated[int, Range(0, 4096)]  # of events; a path has at most so many vertices

Color = tuple[Real, Real, Real]
Light = tuple[Size, Size, Size]
Matrix = Annotated[tuple[Annotated[tuple[Real, ...], Length(4)], ...], Length(4)]  # 4 x 4, rows

# Kinds of rays. A visibility is the sum of the kinds of rays that see an object or a light.
CAMERA, DIFFUSE, GLOSSY, TRANSMISSION, SHADOW = 1, 2, 4, 8, 16
VISIBLE = CAMERA | DIFFUSE | GLOSSY | TRANSMISSION | SHADOW
Visibility = Annotated[int, Range(0, VISIBLE)]

IDENTITY: Matrix = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Loss:
    """One thing of the scene that the bundle does not represent as it is: a line of the coverage report."""

    object: str  # name of the object, or of the world or scene
    where: str  # "material 'Glass', node 'Glass BSDF'"; empty for the object as a whole
    detail: str  # the lost feature, and its substitute


# --- camera and film -------------------------------------------------------------------------------------------------


CameraKind = Literal["perspective", "orthographic", "panorama", "hemisphere"]  # kernels use the index in this list
Filter = Literal["box", "gaussian", "blackman_harris"]  # Cycles' own


@dataclass(frozen=True)
class Camera:
    """A camera that looks along -z of `to_world`, with +y up, like Blender's cameras. Pixel (0, 0) is at the top left."""

    to_world: Matrix  # the upper 3 x 3 is a rotation
    window: tuple[Real, Real, Real, Real]  # left, right, bottom, top of the image at distance 1; orthographic: in metres
    width: Annotated[int, Range(1, 65536)]  # pixels
    height: Annotated[int, Range(1, 65536)]
    # panorama: equirectangular; the window is in radians of longitude and latitude. hemisphere: around +z; the window's x is the azimuth
    # in turns, 0..1, and y is the cosine to +z, so all pixels have the same solid angle.
    kind: CameraKind = "perspective"
    near: Size = 0.0  # clip distances along the view axis; along the ray for panoramas and hemispheres
    far: Annotated[float, Range(0.0, float("inf"))] = float("inf")
    aperture: Size = 0.0  # radius of the lens in metres; at 0 everything is in focus
    focus: Positive = 1.0  # distance of the plane in focus, metres
    blades: Annotated[int, Range(0, 4096)] = 0  # corners of the aperture; 0 makes it round
    blade_rotation: Real = 0.0  # radians
    aperture_ratio: Positive = 1.0  # above 1 the lens is narrower from side to side: anamorphic


@dataclass(frozen=True)
class Film:
    """How samples become pixels."""

    filter: Filter = "box"
    filter_width: Positive = 1.0  # pixels; a box is always 1 wide
    exposure: Annotated[float, Range(0.0, 1e9)] = 1.0  # factor on the image
    transparent: bool = False  # the camera does not see the world; the image has an alpha channel


@dataclass(frozen=True)
class Bounces:
    """Limits of scattering events, counted like `max_bounces`. A path that reaches a limit does not scatter again."""

    total: Limit = 13
    diffuse: Limit = 5
    glossy: Limit = 5
    transmission: Limit = 13
    transparent: Limit = 8  # passages through transparent surfaces; the other limits do not count them
    roulette: Limit = 0  # scattering events before Russian roulette begins


# --- lamps -----------------------------------------------------------------------------------------------------------


LampKind = Literal["point", "spot", "sun", "area"]  # kernels use the index in this list, too


@dataclass(frozen=True)
class Lamp:
    """A light that is not part of a mesh. Shines along -z of `to_world`."""

    name: str
    kind: LampKind
    to_world: Matrix
    # point, spot: radiant intensity, W/sr, without the spot's cone; sun: irradiance, W/m^2; area: radiance, W/(sr m^2), that the lamp
    # would have with a spread of pi
    emission: Light
    radius: Size = 0.0  # point, spot: metres; sun: half angle of its disc, radians
    soft: bool = True  # point, spot: a disc that faces each lit point, not a sphere
    cone: Real = 0.0  # spot: half angle of its cone, radians
    blend: Real = 0.0  # spot: softness of the cone's edge, 0..1
    width: Size = 0.0  # area: metres along x of to_world (whose axes have unit length)
    height: Size = 0.0  # area: metres along y
    ellipse: bool = False  # area: an ellipse of these diameters, not a rectangle
    # area: full angle of the cone of its light, radians; pi: Lambert's law, 0: a parallel beam
    spread: Annotated[float, Range(0.0, 6.2832)] = 3.141592653589793
    visibility: Visibility = VISIBLE & ~CAMERA
    shadow: bool = True  # whether objects block its light
    mis: bool = True  # whether rays can hit it; if not, only light sampling finds it
    shader: Annotated[int, Range(-1, 2**24)] = -1  # index of a shader whose emission is a factor on the lamp's; -1 for none


# --- shaders ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Node:
    """A reference to the value of instruction `index` in the shader's code."""

    index: Count


Value = Real | Color | Node


@dataclass(frozen=True)
class Instruction:
    """One step of a shader's code. It computes one or three numbers from inputs and earlier steps. `ops` lists all ops."""

    op: str
    inputs: tuple[Value, ...] = ()
    mode: str = ""  # the variant of the op, such as "ADD"
    options: tuple[Count, ...] = ()  # whole numbers, constant: index of a texture, table or attribute; flags


@dataclass(frozen=True)
class Closure:
    """A reflection, transmission or emission that a shader adds to its surface, with its inputs by name (see `CLOSURES`)."""

    kind: str
    weight: Value  # factor on the closure: the product of the shares of the Mix Shaders above it
    inputs: dict[str, Value] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if unknown := self.inputs.keys() - CLOSURES.get(self.kind, {}).keys():
            raise MalformedError(f"closure {self.kind!a} has no input {min(unknown)!a}")
        if self.kind not in CLOSURES:
            raise MalformedError(f"closure {self.kind!a} is none of {', '.join(CLOSURES)}")


@dataclass(frozen=True)
class Shader:
    """A surface's or the world's emission, reflection and transmission."""

    name: str
    code: tuple[Instruction, ...] = ()
    closures: tuple[Closure, ...] = ()


# The inputs of each closure and their defaults. They mean the same as Blender's sockets of these names. normal None: the surface's shading
# normal. tangent None: the tangent that Cycles computes by default.
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


# --- the header ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Image:
    """A texture without its texels."""

    name: str
    srgb: bool
    tile: Annotated[int, Range(0, 2000)]
    rest: Count


@dataclass(frozen=True)
class Header:
    """All of a scene that is not arrays."""

    name: str
    shaders: tuple[Shader, ...]
    camera: Camera
    world: Shader
    world_visibility: Visibility
    lamps: tuple[Lamp, ...]
    film: Film
    bounces: Bounces
    textures: tuple[Image, ...]
    coverage: tuple[Loss, ...]
