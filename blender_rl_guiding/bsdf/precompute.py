"""Computes the albedo tables: python -m blender_rl_guiding.bsdf.precompute [FILE] writes tables.npz, and keeps the sheen in the file.

The grids are those of Cycles, so that both have the same interpolation error: equally spaced over [0, 1] in roughness, in cosine and
in z, where z^4 is the reflectance at normal incidence. Values are integrals over visible normals, by a rank-1 lattice.
"""

import sys
from pathlib import Path

import numba
import numpy as np

from ..kernels import kernel, part
from ..kernels.sampling import F
from . import fresnel, microfacet

SIZE, SIZE_3D = 32, 16
_POINTS = 1 << 14  # errors are below 1e-4; Cycles' tables, measured in its renders, agree to four digits
_COSINES = 32  # Gauss-Legendre nodes of an average over the cosine
_GOLDEN = 0.6180339887498949


@part
def _share(alpha, cosine, ior, glass, u1, u2):
    """(contribution of one visible normal to the albedo, contribution to the s of `energy.schlick_albedo`)."""
    v = (np.sqrt(max(F(1) - cosine * cosine, F(0))), F(0), cosine)
    h = microfacet.visible_normal(alpha, alpha, v, u1, u2)
    vh = v[0] * h[0] + v[2] * h[2]
    alpha2 = alpha * alpha
    above = F(1) + microfacet.smith(alpha2, cosine)
    reflected = F(2) * vh * h[2] - cosine
    mirrored = above / (above + microfacet.smith(alpha2, reflected)) if reflected > F(0) else F(0)
    if not glass:
        share = fresnel.schlick_share(vh, ior) if reflected > F(0) else F(0)
        return mirrored, share
    r = fresnel.dielectric(vh, ior)
    refracted = (vh / ior - fresnel.refracted_cosine(vh, ior)) * h[2] - cosine / ior
    # Cycles' tables count light refracted back to the near side as transmitted. These tables do the same, to gain the same energy.
    passed = above / (above + microfacet.smith(alpha2, refracted)) if r < F(1) else F(0)
    return r * mirrored + (F(1) - r) * passed, F(0)


@kernel
def _integrate(roughness, cosine, ior, glass, points):
    """The mean of `_share` over the visible normals."""
    alpha = max(roughness, F(1e-4)) ** 2
    albedo, share = 0.0, 0.0
    for i in range(points):
        u1, u2 = F((i + 0.5) / points), F((i * _GOLDEN) % 1.0)
        a, s = _share(alpha, max(cosine, F(1e-4)), ior, glass, u1, u2)
        albedo += a
        share += s
    return albedo / points, share / points


@kernel
def _schlick5(roughness, cosine, points):
    """The mean of (1 - cos)^5 over the visible normals whose reflection leaves the surface."""
    alpha, mu = max(roughness, F(1e-4)) ** 2, max(cosine, F(1e-4))
    v = (np.sqrt(F(1) - mu * mu), F(0), mu)
    total = 0.0
    for i in range(points):
        h = microfacet.visible_normal(alpha, alpha, v, F((i + 0.5) / points), F((i * _GOLDEN) % 1.0))
        vh = v[0] * h[0] + v[2] * h[2]
        if F(2) * vh * h[2] > mu:
            total += (F(1) - vh) ** 5
    return total / points


def _grid(size: int) -> np.ndarray:
    return np.linspace(0, 1, size, dtype=np.float32)


def iors() -> np.ndarray:
    """The iors of the grid, (16,) float32. z is clamped to 1e-4..0.99: at 0 nothing is reflected, at 1 everything."""
    root = np.clip(_grid(SIZE_3D), 1e-4, 0.99) ** 2  # square root of the reflectance at normal incidence
    return ((1 + root) / (1 - root)).astype(np.float32)


@numba.njit(parallel=True)
def _table(cosines, roughnesses, ior, glass, points):
    """`_integrate` over a grid: (2, cosines, roughnesses)."""
    out = np.empty((2, len(cosines), len(roughnesses)), np.float32)
    for j in numba.prange(len(roughnesses)):
        for i in range(len(cosines)):
            out[0, i, j], out[1, i, j] = _integrate(roughnesses[j], cosines[i], ior, glass, points)
    return out


def _average(roughnesses: np.ndarray, ior: np.float32, glass: bool, points: int) -> np.ndarray:
    """The albedo averaged over projected solid angle, for each roughness."""
    nodes, weights = np.polynomial.legendre.leggauss(_COSINES)
    cosines = ((nodes + 1) / 2).astype(np.float32)
    return np.einsum("ij,i->j", _table(cosines, roughnesses, ior, glass, points)[0], weights * cosines).astype(np.float32)


def tables(points: int = _POINTS) -> dict[str, np.ndarray]:
    """The tables by name. Axes are ior, cosine, roughness, in this order; some tables lack ior or cosine."""
    fine, coarse = _grid(SIZE), _grid(SIZE_3D)
    entering = [_table(coarse, coarse, ior, True, points)[0] for ior in iors()]
    leaving = [_table(coarse, coarse, F(1) / ior, True, points)[0] for ior in iors()]
    return {
        "ggx": _table(fine, fine, F(1), False, points)[0],
        "ggx_average": _average(fine, F(1), False, points),
        "glass": np.stack([np.stack(entering), np.stack(leaving)]),
        "glass_average": np.stack([[_average(coarse, x, True, points) for x in side] for side in (iors(), F(1) / iors())]),
        "schlick": np.stack([_table(coarse, coarse, ior, False, points)[1] for ior in iors()]),
        "schlick5": np.array([[_schlick5(r, c, points) for r in coarse] for c in coarse], np.float32),
    }


if __name__ == "__main__":
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("tables.npz")
    kept = dict(np.load(path)) if path.exists() else {}
    np.savez_compressed(path, allow_pickle=False, **kept | tables())
