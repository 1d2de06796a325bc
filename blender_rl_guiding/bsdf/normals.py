"""Bumped shading normals: bending them for reflections, and softening the terminator."""

import math

from ..kernels import part
from ..kernels.sampling import F, add, dot, scale, subtract
from .lobe import NORMAL, SMOOTH_NORMAL, get, normalized
from .microfacet import smith


@part
def reflectable(ng, wo, n):
    """n, bent towards ng by the least amount that puts the mirror direction of wo above the surface, as in Cycles for glossy lobes.

    The bent normal is m = x t + z ng, with t the unit tangent towards n. The mirror direction of wo about m has the height
    2 (m.wo) z - wo.ng = `height` above the surface. Squaring this gives a quadratic equation for z^2.
    """
    up = dot(wo, ng)
    height = min(F(0.9) * up, F(0.01))
    if n == ng or F(2) * dot(n, wo) * dot(n, ng) - up >= height:
        return n
    t = normalized(subtract(n, scale(ng, dot(n, ng))), n)
    along = dot(wo, t)
    a = along * along + up * up
    b = F(2) * (a + up * height)
    root = math.sqrt(max(b * b - F(4) * a * (height + up) * (height + up), F(0)))
    z2 = F(0.25) * (b + root if along < F(0) else b - root) / a
    return add(scale(t, math.sqrt(max(F(1) - z2, F(0)))), scale(ng, math.sqrt(max(z2, F(0)))))


@part
def leaks(lobes, k, wi):
    """Whether a bumped lobe would send light through the smooth surface: wi is above one of the two normals, but below the other."""
    n, smooth = get(lobes, k, NORMAL), get(lobes, k, SMOOTH_NORMAL)
    return dot(smooth, wi) * dot(smooth, n) * dot(n, wi) < F(0)


@part
def bump_shadowing(lobes, k, wi):
    """Factor in [0, 1] that softens the terminator of bumped diffuse lobes (Estevez et al. 2019, as Cycles uses it)."""
    if leaks(lobes, k, wi):
        return F(0)
    n, smooth = get(lobes, k, NORMAL), get(lobes, k, SMOOTH_NORMAL)
    cos_i, cos_n = abs(dot(smooth, wi)), abs(dot(smooth, n))
    if cos_n >= F(1) or cos_i >= F(1):
        return F(1)
    alpha2 = min(F(0.125) * (F(1) / (cos_n * cos_n) - F(1)), F(1))
    return F(1) / (F(1) + smith(alpha2, cos_i)) if cos_i > F(1e-6) else F(0)
