"""The ops of shader code: every possible `Instruction`. The add-on writes instructions, kernels run them.

Standard library only, because the add-on checks what it exports inside Blender's own Python (3.11 or newer).

All values are triples: a colour, a vector, or one number three times. Conversions are explicit: the op `luminance` turns a colour into a
number, `average` turns a vector into a number. A number is a colour or vector without conversion. Modes have the names of Blender's nodes.
If a node has a `scale` socket in Blender, the op's vector is already scaled, so no op needs more than five inputs.
"""

from enum import IntEnum
from typing import NamedTuple

MAX_INPUTS = 5
MAX_OPTIONS = 4

Light = IntEnum("Light", "IS_CAMERA_RAY IS_SHADOW_RAY IS_DIFFUSE_RAY IS_GLOSSY_RAY IS_TRANSMISSION_RAY RAY_LENGTH RAY_DEPTH", start=0)
# The first twenty operations of Math and VectorMath are the same; on vectors they act by components.
Math = IntEnum(
    "Math",
    "ADD SUBTRACT MULTIPLY DIVIDE MULTIPLY_ADD MINIMUM MAXIMUM ABSOLUTE SIGN ROUND FLOOR CEIL FRACT SNAP WRAP MODULO POWER SINE COSINE "
    "TANGENT TRUNC FLOORED_MODULO PINGPONG LESS_THAN GREATER_THAN COMPARE SMOOTH_MIN SMOOTH_MAX LOGARITHM SQRT INVERSE_SQRT EXPONENT "
    "ARCSINE ARCCOSINE ARCTANGENT ARCTAN2 SINH COSH TANH RADIANS DEGREES",
    start=0,
)
VectorMath = IntEnum(
    "VectorMath",
    "ADD SUBTRACT MULTIPLY DIVIDE MULTIPLY_ADD MINIMUM MAXIMUM ABSOLUTE SIGN ROUND FLOOR CEIL FRACTION SNAP WRAP MODULO POWER SINE COSINE "
    "TANGENT CROSS_PRODUCT PROJECT REFLECT REFRACT FACEFORWARD DOT_PRODUCT DISTANCE LENGTH SCALE NORMALIZE",
    start=0,
)
Blend = IntEnum(
    "Blend",
    "MIX DARKEN MULTIPLY BURN LIGHTEN SCREEN DODGE ADD OVERLAY SOFT_LIGHT LINEAR_LIGHT DIFFERENCE EXCLUSION SUBTRACT DIVIDE HUE "
    "SATURATION COLOR VALUE",
    start=0,
)
Space = IntEnum("Space", "RGB HSV HSL", start=0)
Clamp = IntEnum("Clamp", "MINMAX RANGE", start=0)
Ease = IntEnum("Ease", "LINEAR SMOOTHSTEP SMOOTHERSTEP", start=0)
Mapping = IntEnum("Mapping", "POINT TEXTURE VECTOR NORMAL", start=0)
Weight = IntEnum("Weight", "FRESNEL FACING", start=0)
Gradient = IntEnum("Gradient", "LINEAR QUADRATIC EASING DIAGONAL SPHERICAL QUADRATIC_SPHERE RADIAL", start=0)
Result = IntEnum("Result", "FACTOR COLOR", start=0)  # the output of a texture node

# Options that are not indices of arrays.
Extension = IntEnum("Extension", "REPEAT EXTEND CLIP MIRROR", start=0)
Interpolation = IntEnum("Interpolation", "LINEAR CLOSEST", start=0)
# HORIZON: columns as in EQUIRECTANGULAR; the row of elevation e is (1 + sgn(e) sqrt(|e| 2 / pi)) / 2 of the height.
Projection = IntEnum("Projection", "EQUIRECTANGULAR MIRROR_BALL HORIZON", start=0)
# How an image's colours depend on its alpha. Cycles multiplies colours by alpha, and divides again if the node's Alpha socket has a link:
# PREMULTIPLIED without a link, STRAIGHT with a link. PACKED, also for images without alpha, leaves colours unchanged.
# MULTIPLIED is STRAIGHT for texels that are stored times alpha: they are only divided.
Alpha = IntEnum("Alpha", "PREMULTIPLIED STRAIGHT PACKED MULTIPLIED", start=0)


class Op(NamedTuple):
    """The form of an instruction. An input `normal` is the last one. It may be missing: then it is the shading normal."""

    inputs: tuple[str, ...] = ()
    modes: type[IntEnum] | None = None  # names of the modes; None if the only mode is the empty string
    options: tuple[str, ...] = ()
    pure: bool = True  # whether the value depends only on inputs and options


def _op(inputs: str = "", modes: type[IntEnum] | None = None, options: str = "", pure: bool = True) -> Op:
    return Op(tuple(inputs.split()), modes, tuple(options.split()), pure)


# Options: `texture`, `table`, `attribute` (also tangent, sign, normal) and `object_attribute` (also x_axis, y_axis, z_axis) are indices of
# the scene's arrays of these names. The other options are flags, 0 or 1, or values of the enumerations above.
OPS: dict[str, Op] = {
    # --- the point; vectors are in world space. For the world, position is the direction d of the ray, and normals are -d.
    "position": _op(pure=False),
    "normal": _op(pure=False),  # the shading normal, on the side where the ray comes from
    "true_normal": _op(pure=False),
    "incoming": _op(pure=False),  # the direction to the start of the ray
    "backfacing": _op(pure=False),
    "light_path": _op(modes=Light, pure=False),
    "attribute": _op(options="attribute", pure=False),
    "object_attribute": _op(options="object_attribute", pure=False),
    # A direction from object space to world space, by the axes of the inverse transpose. `tangent` is also perpendicular to n.
    "transform": _op("vector", options="x_axis y_axis z_axis", pure=False),
    "tangent": _op(options="attribute x_axis y_axis z_axis", pure=False),
    # --- textures; uv has its origin at the bottom left
    "image": _op("vector", options="texture extension interpolation alpha"),
    "image_alpha": _op("vector", options="texture extension interpolation"),
    "environment": _op("direction", options="texture projection interpolation"),
    # A sky with the disc of a sun above +y. elevation, and size (the diameter), are in radians. The disc's colour is intensity times the
    # table, and darker at the edge. The table covers the disc from its lowest to its highest elevation. The disc is added to the sky;
    # with `hides` it replaces the sky where the disc is not black.
    "sun_disc": _op("direction sky elevation size intensity", options="table hides"),
    "ramp": _op("factor", options="table interpolate"),
    "ramp_alpha": _op("factor", options="table interpolate"),
    "curves": _op("factor color", options="table extrapolate"),  # each channel has a column of the table, which covers 0..1
    "float_curve": _op("factor value", options="table extrapolate"),  # the first column of the table
    # --- arithmetic
    "math": _op("a b c", Math, "clamp"),  # results of all modes are numbers
    "vector_math": _op("a b c scale", VectorMath),
    "clamp": _op("value minimum maximum", Clamp),
    "map_range": _op("value from_min from_max to_min to_max", Ease, "clamp"),  # by components. STEPPED: to 0..1, `steps`, from 0..1
    "steps": _op("factor steps"),
    "mapping": _op("vector location rotation scale", Mapping),
    "component": _op("vector", options="index"),
    "average": _op("vector"),
    # --- colours
    "luminance": _op("color"),
    "mix": _op("factor a b", Blend, "clamp_factor clamp_result"),  # MIX acts by components: its factor may be a vector
    "invert": _op("factor color"),
    "gamma": _op("color gamma"),
    "bright_contrast": _op("color bright contrast"),
    "hsv": _op("hue saturation value factor color"),
    "separate": _op("color", Space),
    "combine": _op("a b c", Space),
    # --- values that depend on the angle
    "fresnel": _op("ior normal", pure=False),
    "layer_weight": _op("blend normal", Weight, pure=False),
    # --- normals
    # From a normal map's vector to a direction in object space, the space of the attributes; zero if the object lacks the attributes.
    "tangent_space": _op("vector strength", options="tangent sign normal", pure=False),
    "bend": _op("direction strength", pure=False),  # the shading normal, bent towards a direction on the surface's front side
    "bump": _op("height strength distance normal", options="invert", pure=False),
    # --- procedural textures
    "checker": _op("vector color1 color2", Result),
    "gradient": _op("vector", Gradient),
    "white_noise": _op("vector", Result, "dimensions"),  # 1 to 3 dimensions; in 1D the number w is the vector's x
    "noise": _op("vector detail roughness lacunarity distortion", Result, "dimensions normalize"),  # only the type fBM
}


def fault(op: str, mode: str, inputs: int, options: int) -> str:
    """The fault of an instruction of this shape, in a few words; empty if it has none."""
    if op not in OPS:
        return "there is no such op"
    names, modes, wanted, _ = OPS[op]
    if mode not in (modes.__members__ if modes else ("",)):
        return f"there is no mode {mode!r}"
    least = len(names) - (names[-1:] == ("normal",))
    if not least <= inputs <= len(names):
        return f"{inputs} inputs instead of {names}"
    return "" if options == len(wanted) else f"{options} options instead of {wanted}"
