"""Lamps with shaders: emission of the lamp (`lamps`) times emission of its shader, at the sampled or hit point."""

import numpy as np

from ..bsdf.surface import emission
from ..kernels import kernel, part
from ..kernels.pointers import ref
from ..kernels.sampling import F, add, multiply, scale, stream, subtract, uniform2
from ..scene.data import SceneData
from ..shading.evaluate import run
from ..shading.operands import KINDS, REGISTERS, Shading, make_point
from .lamps import AREA, AXIS_Z, EMISSION, KIND, POSITION, RADIUS, SHADER, SOFT, SUN, lamp_table, sample, three

PROBES = 512  # points that estimate the mean of a varying shader
_LEAST = 0.01  # added to that mean: the points may miss the bright parts of the shader
_FARTHEST = F(3.4028235e38)  # length of rays to suns, as in Cycles
_ONE, _DARK = (F(1), F(1), F(1)), (F(0), F(0), F(0))
_EMISSION = KINDS.index("emission")


def shaded_lamps(scene: SceneData, shading: Shading, constant: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The `lamp_table` with positions from the scene's origin, and the mean emission of each lamp, (K, 3) float64.

    constant: (S,) bool, whether a shader emits the same everywhere; the table then includes its emission.
    """
    lamps = lamp_table(scene.lamps)
    lamps[:, POSITION:EMISSION] -= scene.origin
    for row in lamps:
        shader = int(row[SHADER])
        if shader >= 0 and constant[shader] and (factor := _constant_emission(shading, shader)) is not None:
            row[EMISSION:RADIUS] *= factor
            row[SHADER] = -1
    factors = np.ones((len(lamps), 3), np.float32)
    varying = lamps[:, SHADER] >= 0
    if varying.any():
        low, high = scene.bounds
        probe_lamps(lamps, shading, np.zeros((REGISTERS, 3), np.float32), low, high, factors)
        factors[varying] = np.nan_to_num(factors[varying]) + F(_LEAST)
    return lamps, lamps[:, EMISSION:RADIUS].astype(np.float64) * factors


def _constant_emission(shading: Shading, shader: int) -> np.ndarray | None:
    """The sum of a shader's emission closures, (3,); 0 if the sum is not finite; None if the shader has other closures."""
    first, end = shading.shaders[shader, 2:]
    rows = shading.closures[first:end]
    if (rows[:, 0] != _EMISSION).any():
        return None
    factor = np.prod(shading.constants[rows[:, 1:4]].clip(0), axis=1).sum(axis=0)
    return factor if np.isfinite(factor).all() else np.zeros(3)


@part
def lamp_light(lamps, shading, registers, k, x, wi, distance, light, depth):
    """Light of lamp k at x, RGB: `light` times the shader's emission at x + distance wi.

    light: RGB, of the lamp without its shader. depth: scattering events, with the one at x. As in Cycles, a lamp's shader does not know
    the kind of ray.
    """
    shader = np.int64(lamps[k, SHADER])
    if shader < 0:
        return light
    wo = scale(wi, F(-1))
    distance = min(distance, _FARTHEST)
    y = add(x, scale(wi, distance))
    n = _normal(lamps, k, y, wo)
    o = shading.origin
    y = wo if lamps[k, KIND] == F(SUN) else add(y, (o[0], o[1], o[2]))
    point = ref(make_point(y, n, n, wo, -1, -1, F(0), F(0), 0, 0, distance, depth))
    run(shading, shader, point, registers)
    factor = emission(shading, shader, point, registers)
    return multiply(light, factor) if np.isfinite(factor[0] + factor[1] + factor[2]) else _DARK


@part
def _normal(lamps, k, y, wo):
    """Unit normal of lamp k at y. It is wo if the lamp has no surface (sun, radius 0), or its disc faces each lit point (soft)."""
    kind, r = lamps[k, KIND], lamps[k, RADIUS]
    if kind == F(AREA):
        return scale(three(lamps, k, AXIS_Z), F(-1))
    if kind == F(SUN) or r == F(0) or lamps[k, SOFT] > F(0):
        return wo
    return scale(subtract(y, three(lamps, k, POSITION)), F(1) / r)


@kernel
def probe_lamps(lamps, shading, registers, low, high, factors):
    """Write to `factors`, (K, 3), the mean emission of each lamp's shader, as seen from random points x in the box low .. high."""
    shading = ref(shading)
    for k in range(lamps.shape[0]):
        if lamps[k, SHADER] < F(0):
            continue
        total = _DARK
        for i in range(PROBES):
            key = stream(0, i, 0, False)
            (a, b), (c, u), (v, _) = uniform2(key, 0), uniform2(key, 1), uniform2(key, 2)
            x = low[0] + a * (high[0] - low[0]), low[1] + b * (high[1] - low[1]), low[2] + c * (high[2] - low[2])
            wi, distance, _, _ = sample(lamps, k, x, u, v)
            total = add(total, lamp_light(lamps, shading, registers, k, x, wi, distance, _ONE, np.int64(1)))
        for c in range(3):
            factors[k, c] = total[c] / F(PROBES)
