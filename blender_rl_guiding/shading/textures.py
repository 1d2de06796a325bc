"""Reads images, colour ramps and curves."""

import math

import numpy as np

from ..kernels import part
from ..kernels.sampling import INV_PI, F
from ..scene.ops import Alpha, Extension, Interpolation, Projection
from .arithmetic import lerp, saturate
from .vectors import unit

CODES, SRGB_CODES, FLOATS = range(3)  # kinds of texels: 8 bits, 8 bits in sRGB, single precision
OUTSIDE = -1
TILE, REST = 4, 5  # columns of the table of textures
U = np.uint32
# int32, like the options in shader code: for literals, Numba would compile the functions that read them again.
REPEAT, PACKED, PREMULTIPLIED = np.int32(Extension.REPEAT), np.int32(Alpha.PACKED), np.int32(Alpha.PREMULTIPLIED)
HOLD, INTERPOLATE = np.int32(0), np.int32(1)

# --- texels ----------------------------------------------------------------------------------------------------------


@part
def decode(c):
    """The linear value of an sRGB code in 0..1."""
    if c < F(0.04045):
        return max(c, F(0)) * F(1 / 12.92)
    return ((c + F(0.055)) * F(1 / 1.055)) ** F(2.4)


@part
def place(i, size, extension):
    """The index of the texel, 0..size-1, at place i by the rule `extension`; OUTSIDE if there is none."""
    if 0 <= i < size:
        return i
    if extension == Extension.REPEAT:
        return i % size
    if extension == Extension.EXTEND:
        return min(max(i, 0), size - 1)
    if extension == Extension.CLIP:
        return OUTSIDE
    i %= 2 * size
    return min(i, 2 * size - 1 - i)


@part
def multiplies(alpha):
    """Whether texels are multiplied by their alpha before interpolation."""
    return alpha == Alpha.PREMULTIPLIED or alpha == Alpha.STRAIGHT


@part
def byte_texel(row, alpha):
    """RGBA of an 8-bit texel, in 0..1. As in Cycles, codes times alpha are rounded down to whole numbers."""
    r, g, b, a = U(row[0]), U(row[1]), U(row[2]), U(row[3])
    if multiplies(alpha):
        r, g, b = U(r * a // U(255)), U(g * a // U(255)), U(b * a // U(255))
    s = F(1 / 255)
    return F(r) * s, F(g) * s, F(b) * s, F(a) * s


@part
def float_texel(row, alpha):
    """RGBA of a texel in single precision."""
    a = row[3]
    s = a if multiplies(alpha) else F(1)
    return row[0] * s, row[1] * s, row[2] * s, a


@part
def texel(shading, texture, x, y, alpha):
    """RGBA of the texel (x, y) from the bottom left, not decoded. Colours are times the texel's alpha if `multiplies`."""
    if x == OUTSIDE or y == OUTSIDE:
        return F(0), F(0), F(0), F(0)
    width, height = shading.textures[texture, 1], shading.textures[texture, 2]
    at = shading.textures[texture, 0] + (height - 1 - y) * width + x
    if shading.textures[texture, 3] == FLOATS:
        return float_texel(shading.floats[at], alpha)
    return byte_texel(shading.bytes[at], alpha)


@part
def between(p, q, t):
    """p + t (q - p), RGBA."""
    return lerp(p[0], q[0], t), lerp(p[1], q[1], t), lerp(p[2], q[2], t), lerp(p[3], q[3], t)


@part
def bilinear(shading, texture, x, y, extension, alpha):
    """RGBA at (x, y), by bilinear interpolation of texels that are not decoded. (x, y): in texels, from the bottom left."""
    x0, y0 = np.floor(x - F(0.5)), np.floor(y - F(0.5))
    s, t = x - F(0.5) - x0, y - F(0.5) - y0
    width, height = shading.textures[texture, 1], shading.textures[texture, 2]
    left, right = place(np.int64(x0), width, extension), place(np.int64(x0) + 1, width, extension)
    low, high = place(np.int64(y0), height, extension), place(np.int64(y0) + 1, height, extension)
    below = between(texel(shading, texture, left, low, alpha), texel(shading, texture, right, low, alpha), s)
    above = between(texel(shading, texture, left, high, alpha), texel(shading, texture, right, high, alpha), s)
    return between(below, above, t)


@part
def find_tile(shading, texture, u, v):
    """(tile, u, v within the tile) at (u, v) of a tiled image. texture: its first tile. The tile is OUTSIDE if there is none.

    As in Cycles, tiles at the left and lower edge also cover the coordinates from -1 to 0.
    """
    if not (F(-1) < u < F(10) and F(-1) < v < F(100)):
        return np.int64(OUTSIDE), u, v
    column, row = np.int64(u), np.int64(v)
    for k in range(texture, texture + shading.textures[texture, REST] + 1):
        if shading.textures[k, TILE] == 1001 + column + 10 * row:
            return np.int64(k), u - F(column), v - F(row)
    return np.int64(OUTSIDE), u, v


@part
def lookup(shading, texture, u, v, extension, interpolation, alpha):
    """RGBA of an image in linear light, in Cycles' order: multiply by alpha, interpolate, divide by alpha, decode.

    Black and transparent if u or v is not finite; magenta if there is no tile.
    """
    if not (math.isfinite(u) and math.isfinite(v)):
        return F(0), F(0), F(0), F(0)
    texture = np.int64(texture)
    if shading.textures[texture, TILE] != 0:
        texture, u, v = find_tile(shading, texture, u, v)
        if texture == OUTSIDE:
            return F(1), F(0), F(1), F(1)
    width, height, kind = shading.textures[texture, 1], shading.textures[texture, 2], shading.textures[texture, 3]
    x, y = u * F(width), v * F(height)
    if interpolation == Interpolation.LINEAR:
        r, g, b, a = bilinear(shading, texture, x, y, extension, alpha)
    else:
        column, row = place(np.int64(np.floor(x)), width, extension), place(np.int64(np.floor(y)), height, extension)
        r, g, b, a = texel(shading, texture, column, row, alpha)
    if (alpha == Alpha.STRAIGHT or alpha == Alpha.MULTIPLIED) and a != F(0):
        r, g, b = r / a, g / a, b / a
    return (decode(r), decode(g), decode(b), a) if kind == SRGB_CODES else (r, g, b, a)


# --- images ----------------------------------------------------------------------------------------------------------


@part
def image(shading, uv, texture, extension, interpolation, alpha):
    """The colour of the Image Texture node."""
    r, g, b, _ = lookup(shading, texture, uv[0], uv[1], extension, interpolation, alpha)
    return r, g, b


@part
def image_alpha(shading, uv, texture, extension, interpolation):
    """The alpha of the Image Texture node, three times."""
    a = lookup(shading, texture, uv[0], uv[1], extension, interpolation, PACKED)[3]
    return a, a, a


@part
def equirectangular(d):
    """(u, v) of unit vector d on a map of longitude and latitude. +x is in the middle, -y a quarter of the width to its right."""
    return F(0.5) - F(0.5) * INV_PI * math.atan2(d[1], d[0]), F(1) - INV_PI * math.acos(min(max(d[2], F(-1)), F(1)))


@part
def mirror_ball(d):
    """(u, v) of unit vector d in the photograph of a mirror ball, taken along +y."""
    length = F(2) * math.sqrt(max(F(0.5) - F(0.5) * d[1], F(0)))
    if length == F(0):
        return F(0.5), F(0.5)
    return F(0.5) + F(0.5) * d[0] / length, F(0.5) + F(0.5) * d[2] / length


@part
def horizon(d, rows):
    """(u, v) of vector d on a map with more rows near the horizon (`Projection.HORIZON`). rows: the map's number of rows.

    v is clamped to the middles of the first and last row. As in Cycles, d is not normalized: the elevation is arcsin(z).
    """
    e = F(2) * INV_PI * math.asin(min(max(d[2], F(-1)), F(1)))
    half_row = F(0.5) / F(rows)
    v = F(0.5) + F(0.5) * math.copysign(math.sqrt(abs(e)), e)
    return F(0.5) - F(0.5) * INV_PI * math.atan2(d[1], d[0]), min(max(v, half_row), F(1) - half_row)


@part
def environment(shading, direction, texture, projection, interpolation):
    """The colour of the Environment Texture node."""
    if projection == Projection.HORIZON:
        u, v = horizon(direction, shading.textures[texture, 2])
    else:
        d = unit(direction)
        u, v = equirectangular(d) if projection == Projection.EQUIRECTANGULAR else mirror_ball(d)
    r, g, b, _ = lookup(shading, texture, u, v, REPEAT, interpolation, PREMULTIPLIED)
    return r, g, b


# --- tables ----------------------------------------------------------------------------------------------------------


@part
def table_value(tables, table, column, x, interpolate, extrapolate):
    """The value at x of a table over 0..1. Outside 0..1 it is constant, or with `extrapolate` a straight line."""
    last = tables.shape[1] - 1
    s = (x if extrapolate else saturate(x)) * F(last)
    i = min(max(np.int64(s), 0), last - 1 if interpolate else last)
    low = tables[table, i, column]
    return lerp(low, tables[table, i + 1, column], s - F(i)) if interpolate else low


@part
def ramp(tables, x, table, interpolate):
    """The colour of the Color Ramp node."""
    return (
        table_value(tables, table, 0, x, interpolate, HOLD),
        table_value(tables, table, 1, x, interpolate, HOLD),
        table_value(tables, table, 2, x, interpolate, HOLD),
    )


@part
def ramp_alpha(tables, x, table, interpolate):
    """The alpha of the Color Ramp node, three times."""
    a = table_value(tables, table, 3, x, interpolate, HOLD)
    return a, a, a


@part
def curves(tables, t, c, table, extrapolate):
    """The RGB Curves node. Each column of the table is a channel's curve, combined with the common curve."""
    return (
        lerp(c[0], table_value(tables, table, 0, c[0], INTERPOLATE, extrapolate), t),
        lerp(c[1], table_value(tables, table, 1, c[1], INTERPOLATE, extrapolate), t),
        lerp(c[2], table_value(tables, table, 2, c[2], INTERPOLATE, extrapolate), t),
    )


@part
def float_curve(tables, t, x, table, extrapolate):
    """The Float Curve node, three times."""
    y = lerp(x, table_value(tables, table, 0, x, INTERPOLATE, extrapolate), t)
    return y, y, y
