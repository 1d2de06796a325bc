"""Procedural textures: Checker, Gradient, White Noise and Noise, with the same values as in Cycles.

The hash is Bob Jenkins's lookup3 (public domain), the noise Ken Perlin's improved one (SIGGRAPH 2002).
"""

import math

import numpy as np

from ..kernels import part
from ..kernels.sampling import INV_PI, F
from ..scene.ops import Gradient, Result
from .arithmetic import lerp, saturate

U = np.uint32
INCLUSIVE = F(1 / 0xFFFFFFFF)  # scales a hash to 0..1
PERIOD = F(100_000)
SPAN_1D, SPAN_2D, SPAN_3D = F(0.25), F(0.6616), F(0.982)  # scale noise of each dimension to -1..1

# --- regular ---------------------------------------------------------------------------------------------------------


@part
def parity(x):
    """floor(x + a small number) mod 2: in spite of rounding, a whole number belongs to the interval above it."""
    return np.int64(np.floor((x + F(1e-6)) * F(0.999999))) & 1


@part
def checker(mode, p, a, b):
    """The Checker Texture node."""
    first = (parity(p[0]) ^ parity(p[1]) ^ parity(p[2])) == 1
    if mode == Result.FACTOR:
        return F(first), F(first), F(first)
    return a if first else b


@part
def gradient(mode, p):
    """The Gradient Texture node."""
    x, y, z = p
    if mode == Gradient.LINEAR:
        return saturate(x)
    if mode == Gradient.QUADRATIC:
        return saturate(max(x, F(0)) * max(x, F(0)))
    if mode == Gradient.EASING:
        t = saturate(x)
        return t * t * (F(3) - F(2) * t)
    if mode == Gradient.DIAGONAL:
        return saturate(F(0.5) * (x + y))
    if mode == Gradient.RADIAL:
        return F(0.5) * INV_PI * math.atan2(y, x) + F(0.5)
    inside = max(F(0.999999) - math.sqrt(x * x + y * y + z * z), F(0))
    return inside * inside if mode == Gradient.QUADRATIC_SPHERE else inside


# --- hashes ----------------------------------------------------------------------------------------------------------


@part
def turn(x, k):
    """The bits of x, rotated to the left by k."""
    return U(U(x << U(k)) | (x >> U(32 - k)))


@part
def finish(a, b, c):
    """The last step of lookup3."""
    c = U((c ^ b) - turn(b, 14))
    a = U((a ^ c) - turn(c, 11))
    b = U((b ^ a) - turn(a, 25))
    c = U((c ^ b) - turn(b, 16))
    a = U((a ^ c) - turn(c, 4))
    b = U((b ^ a) - turn(a, 14))
    return U((c ^ b) - turn(b, 24))


@part
def hash_words(count, x, y, z):
    """The hash of the first `count` (1 to 3) words of 32 bits; the other words must be 0."""
    start = U(0xDEADBEEF + 13 + 4 * count)
    return finish(U(start + x), U(start + y), U(start + z))


@part
def hash_four(x, y, z, w):
    """The hash of 4 words of 32 bits."""
    start = U(0xDEADBEEF + 13 + 4 * 4)
    a, b, c = U(start + x), U(start + y), U(start + z)
    a = U(U(a - c) ^ turn(c, 4))
    c = U(c + b)
    b = U(U(b - a) ^ turn(a, 6))
    a = U(a + c)
    c = U(U(c - b) ^ turn(b, 8))
    b = U(b + a)
    a = U(U(a - c) ^ turn(c, 16))
    c = U(c + b)
    b = U(U(b - a) ^ turn(a, 19))
    a = U(a + c)
    c = U(U(c - b) ^ turn(b, 4))
    return finish(U(a + w), U(b + a), c)


@part
def bits(x):
    """The 32 bits of x in memory."""
    return np.float32(x).view(np.uint32)


@part
def random(count, x, y, z):
    """The hash of the first `count` (1 to 3) numbers, as a number in 0..1; the other numbers must be 0."""
    return F(hash_words(count, bits(x), bits(y), bits(z))) * INCLUSIVE


@part
def random_color(count, p, seed):
    """The second (seed 1) or third (seed 2) component of white noise's colour."""
    if count == 3:
        return F(hash_four(bits(p[0]), bits(p[1]), bits(p[2]), bits(seed))) * INCLUSIVE
    if count == 2:
        return random(3, p[0], p[1], seed)
    return random(2, p[0], seed, F(0))


@part
def white_noise(mode, p, count):
    """The White Noise Texture node in `count` dimensions."""
    # The hash reads the bits: as in Cycles, 0 and -0 give different results.
    y, z = p[1] if count > 1 else F(0), p[2] if count > 2 else F(0)
    first = random(count, p[0], y, z)
    if mode == Result.FACTOR:
        return first, first, first
    return first, random_color(count, p, F(1)), random_color(count, p, F(2))


# --- noise -----------------------------------------------------------------------------------------------------------


@part
def fade(t):
    """6 t^5 - 15 t^4 + 10 t^3: rises from 0 to 1, with a continuous second derivative."""
    return t * t * t * (t * (t * F(6) - F(15)) + F(10))


@part
def slope_1d(i, x):
    """g x, with a random gradient g at lattice point i, and x the offset from this lattice point."""
    h = hash_words(1, U(i), U(0), U(0))
    g = F(1) + F(h & U(7))
    return -g * x if h & U(8) else g * x


@part
def slope_2d(i, j, x, y):
    """As slope_1d, in the plane."""
    h = hash_words(2, U(i), U(j), U(0))
    a, b = (x, y) if h & U(7) < U(4) else (y, x)
    return (-a if h & U(1) else a) + F(2) * (-b if h & U(2) else b)


@part
def slope_3d(i, j, k, x, y, z):
    """As slope_1d, in space."""
    word = hash_words(3, U(i), U(j), U(k))
    h = word & U(15)
    a = x if h < U(8) else y
    b = y if h < U(4) else (x if h == U(12) or h == U(14) else z)
    return (-a if h & U(1) else a) + (-b if h & U(2) else b)


@part
def perlin_1d(x):
    """Gradient noise on a line."""
    i = np.int64(np.floor(x))
    x -= np.floor(x)
    return lerp(slope_1d(i, x), slope_1d(i + 1, x - F(1)), fade(x))


@part
def perlin_2d(x, y):
    """Gradient noise in the plane."""
    i, j = np.int64(np.floor(x)), np.int64(np.floor(y))
    x, y = x - np.floor(x), y - np.floor(y)
    low = lerp(slope_2d(i, j, x, y), slope_2d(i + 1, j, x - F(1), y), fade(x))
    high = lerp(slope_2d(i, j + 1, x, y - F(1)), slope_2d(i + 1, j + 1, x - F(1), y - F(1)), fade(x))
    return lerp(low, high, fade(y))


@part
def perlin_3d(x, y, z):
    """Gradient noise in space."""
    i, j, k = np.int64(np.floor(x)), np.int64(np.floor(y)), np.int64(np.floor(z))
    x, y, z = x - np.floor(x), y - np.floor(y), z - np.floor(z)
    u, v, value = fade(x), fade(y), F(0)
    for above in range(2):
        c, w = k + above, z - F(above)
        low = lerp(slope_3d(i, j, c, x, y, w), slope_3d(i + 1, j, c, x - F(1), y, w), u)
        high = lerp(slope_3d(i, j + 1, c, x, y - F(1), w), slope_3d(i + 1, j + 1, c, x - F(1), y - F(1), w), u)
        value += lerp(low, high, v) * (fade(z) if above else F(1) - fade(z))
    return value


@part
def noise_at(count, p, s):
    """Noise in -1..1 at s p; 0 on the lattice. Its period is PERIOD, because single precision cannot resolve the lattice further out."""
    x, y, z = np.fmod(s * p[0], PERIOD), np.fmod(s * p[1], PERIOD), np.fmod(s * p[2], PERIOD)
    if count == 1:
        return SPAN_1D * perlin_1d(x)
    return SPAN_2D * perlin_2d(x, y) if count == 2 else SPAN_3D * perlin_3d(x, y, z)


@part
def fractal(count, p, detail, roughness, lacunarity, normalized):
    """Fractal Brownian motion: octave k of noise has scale lacunarity^k and weight roughness^k, k = 0..detail.

    If `detail` is not whole, its fraction blends between the sums without and with the last octave.
    """
    whole = np.int64(detail)
    total, weight, amplitude, s = F(0), F(0), F(1), F(1)
    for octave in range(whole + 2):
        share = F(1) if octave <= whole else detail - F(whole)
        if share == F(0):
            break
        more, heavier = total + amplitude * noise_at(count, p, s), weight + amplitude
        if share < F(1):
            a, b = (F(0.5) * total / weight + F(0.5), F(0.5) * more / heavier + F(0.5)) if normalized else (total, more)
            return lerp(a, b, share)
        total, weight, amplitude, s = more, heavier, amplitude * roughness, s * lacunarity
    return F(0.5) * total / weight + F(0.5) if normalized else total


@part
def elsewhere(count, p, first):
    """p plus an offset that makes the noise independent. Component i of the offset is a hash of (first, i); in 1D, of `first`."""
    if count == 1:
        return p[0] + F(100) + F(100) * random(1, first, F(0), F(0)), p[1], p[2]
    return (
        p[0] + F(100) + F(100) * random(2, first, F(0), F(0)),
        p[1] + F(100) + F(100) * random(2, first, F(1), F(0)),
        p[2] + F(100) + F(100) * random(2, first, F(2), F(0)),
    )


@part
def distorted(count, p, strength):
    """p + `strength` * noise."""
    x = p[0] + strength * noise_at(count, elsewhere(count, p, F(0)), F(1))
    y = p[1] + strength * noise_at(count, elsewhere(count, p, F(1)), F(1)) if count > 1 else F(0)
    z = p[2] + strength * noise_at(count, elsewhere(count, p, F(2)), F(1)) if count > 2 else F(0)
    return x, y, z


@part
def noise(mode, p, detail, roughness, lacunarity, distortion, count, normalized):
    """The Noise Texture node, of type fBM, in `count` dimensions."""
    detail, roughness = min(max(detail, F(0)), F(15)), max(roughness, F(0))
    if distortion != F(0):
        p = distorted(count, p, distortion)
    first = fractal(count, p, detail, roughness, lacunarity, normalized)
    if mode == Result.FACTOR:
        return first, first, first
    second = fractal(count, elsewhere(count, p, F(count)), detail, roughness, lacunarity, normalized)
    third = fractal(count, elsewhere(count, p, F(count + 1)), detail, roughness, lacunarity, normalized)
    return first, second, third
