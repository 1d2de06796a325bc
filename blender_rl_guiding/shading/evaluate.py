"""Runs a shader's code: each instruction reads operands and writes one register."""

from enum import IntEnum

from ..kernels import part
from ..kernels.pointers import ref
from ..kernels.sampling import F, store
from . import arithmetic, colors, geometry, procedural, sky, textures, vectors
from .operands import value

# The ops of scene.ops in upper case, by family. Only the compiler writes SHIFT: the steps after it run at a point beside the point.
Code = IntEnum(
    "Code",
    "SHIFT POSITION NORMAL TRUE_NORMAL INCOMING BACKFACING LIGHT_PATH ATTRIBUTE OBJECT_ATTRIBUTE TANGENT TRANSFORM "
    "IMAGE IMAGE_ALPHA ENVIRONMENT SUN_DISC RAMP RAMP_ALPHA CURVES FLOAT_CURVE "
    "MATH VECTOR_MATH CLAMP MAP_RANGE STEPS MAPPING COMPONENT AVERAGE "
    "LUMINANCE MIX INVERT GAMMA BRIGHT_CONTRAST HSV SEPARATE COMBINE "
    "FRESNEL LAYER_WEIGHT TANGENT_SPACE BEND BUMP "
    "CHECKER GRADIENT WHITE_NOISE NOISE",
    start=0,
)
# The first op of each family. The first family, values of the point, begins at 0.
TEXTURES, NUMBERS, COLORS, ANGLES, PROCEDURAL = (code.value for code in (Code.IMAGE, Code.MATH, Code.LUMINANCE, Code.FRESNEL, Code.CHECKER))
INPUTS, OPTIONS = 3, 8  # where an instruction's operands and options begin


@part
def thrice(x):
    """(x, x, x): a number as a value of three numbers."""
    return x, x, x


@part
def _of_point(shading, point, op, mode, options):
    if op == Code.ATTRIBUTE:
        return geometry.attribute(shading, point, options[0])
    if op == Code.OBJECT_ATTRIBUTE:
        return geometry.object_attribute(shading, point, options[0])
    if op == Code.POSITION:
        return geometry.position(shading, point)
    if op == Code.NORMAL:
        return point.n
    if op == Code.TRUE_NORMAL:
        return point.ng
    if op == Code.INCOMING:
        return point.wo
    if op == Code.TANGENT:
        return geometry.tangent(shading, point, options[0], options[1], options[2], options[3])
    return thrice(F(point.backfacing) if op == Code.BACKFACING else geometry.light_path(mode, point))


@part
def _of_texture(shading, op, options, a, b, c, d, e):
    if op == Code.IMAGE:
        return textures.image(shading, a, options[0], options[1], options[2], options[3])
    if op == Code.IMAGE_ALPHA:
        return textures.image_alpha(shading, a, options[0], options[1], options[2])
    if op == Code.ENVIRONMENT:
        return textures.environment(shading, a, options[0], options[1], options[2])
    if op == Code.SUN_DISC:
        return sky.sun_disc(shading.tables, a, b, c[0], d[0], e[0], options[0], options[1])
    if op == Code.RAMP:
        return textures.ramp(shading.tables, a[0], options[0], options[1])
    if op == Code.RAMP_ALPHA:
        return textures.ramp_alpha(shading.tables, a[0], options[0], options[1])
    if op == Code.CURVES:
        return textures.curves(shading.tables, a[0], b, options[0], options[1])
    return textures.float_curve(shading.tables, a[0], b[0], options[0], options[1])


@part
def _of_numbers(op, mode, option, a, b, c, d, e):
    if op == Code.MATH:
        x = arithmetic.number_math(mode, a[0], b[0], c[0])
        return thrice(arithmetic.saturate(x) if option else x)
    if op == Code.VECTOR_MATH:
        return vectors.vector_math(mode, a, b, c, d[0])
    if op == Code.MAPPING:
        return vectors.mapping(mode, a, b, c, d)
    if op == Code.MAP_RANGE:
        return arithmetic.map_ranges(mode, option, a, b, c, d, e)
    if op == Code.COMPONENT:
        return thrice(a[0] if option == 0 else (a[1] if option == 1 else a[2]))
    if op == Code.AVERAGE:
        return thrice((a[0] + a[1] + a[2]) * F(1 / 3))
    return thrice(arithmetic.clamp(mode, a[0], b[0], c[0])) if op == Code.CLAMP else arithmetic.steps(a, b)


@part
def _of_colors(op, mode, options, a, b, c, d, e):
    if op == Code.MIX:
        return colors.mix(mode, options[0], options[1], a, b, c)
    if op == Code.LUMINANCE:
        return colors.grey(a)
    if op == Code.SEPARATE:
        return colors.separate(mode, a)
    if op == Code.COMBINE:
        return colors.combine(mode, (a[0], b[0], c[0]))
    if op == Code.INVERT:
        return colors.invert(a[0], b)
    if op == Code.GAMMA:
        return colors.gamma(a, b[0])
    if op == Code.BRIGHT_CONTRAST:
        return colors.bright_contrast(a, b[0], c[0])
    return colors.hue_saturation_value(a[0], b[0], c[0], d[0], e)


@part
def _of_angles(shading, point, op, mode, options, a, b, c, d):
    if op == Code.TANGENT_SPACE:
        return geometry.tangent_space(shading, point, a, b[0], options[0], options[1], options[2])
    if op == Code.BEND:
        return geometry.bend(point, a, b[0])
    if op == Code.BUMP:
        return geometry.bump(point, a, b[0], -c[0] if options[0] else c[0], d)
    if op == Code.FRESNEL:
        return thrice(geometry.fresnel(point, a[0], b))
    return thrice(geometry.layer_weight(mode, point, a[0], b))


@part
def _procedural(op, mode, options, a, b, c, d, e):
    if op == Code.CHECKER:
        return procedural.checker(mode, a, b, c)
    if op == Code.GRADIENT:
        return thrice(procedural.gradient(mode, a))
    if op == Code.WHITE_NOISE:
        return procedural.white_noise(mode, a, options[0])
    return procedural.noise(mode, a, b[0], c[0], d[0], e[0], options[0], options[1])


@part
def _compute(shading, point, registers, line):
    """The value of an instruction."""
    op, mode = line[0], line[1]
    options = line[OPTIONS], line[OPTIONS + 1], line[OPTIONS + 2], line[OPTIONS + 3]
    if op < Code.TRANSFORM:
        return _of_point(shading, point, op, mode, options)
    a, b, c, d, e = (
        value(shading, registers, line[INPUTS]),
        value(shading, registers, line[INPUTS + 1]),
        value(shading, registers, line[INPUTS + 2]),
        value(shading, registers, line[INPUTS + 3]),
        value(shading, registers, line[INPUTS + 4]),
    )
    if op < TEXTURES:
        return geometry.axes(shading, point, options[0], options[1], options[2], a)
    if op < NUMBERS:
        return _of_texture(shading, op, options, a, b, c, d, e)
    if op < COLORS:
        return _of_numbers(op, mode, options[0], a, b, c, d, e)
    if op < ANGLES:
        return _of_colors(op, mode, options, a, b, c, d, e)
    if op < PROCEDURAL:
        return _of_angles(shading, point, op, mode, options, a, b, c, d)
    return _procedural(op, mode, options, a, b, c, d, e)


@part
def run(shading, shader, point, registers):
    """Run a shader's code at a point. The results stay in `registers`; closures read them there.

    registers: (256, 3) float32, memory of this thread alone.
    """
    here = ref(point)
    for i in range(shading.shaders[shader, 0], shading.shaders[shader, 1]):
        line = shading.code[i]
        if line[0] == Code.SHIFT:
            direction = line[OPTIONS + 1] if point.object >= 0 else 0
            here = ref(geometry.shifted(shading, point, line[OPTIONS], direction)) if direction > 0 else ref(point)
        else:
            store(registers, line[2], _compute(shading, here, registers, line))
