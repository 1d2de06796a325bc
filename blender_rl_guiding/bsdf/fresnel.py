"""Reflectance of interfaces: of dielectrics by Fresnel's equations, and by the two curves of Blender's materials.

Every ior here is (ior on the far side) / (ior on wo's side).
"""

import math

from ..kernels import part
from ..kernels.sampling import F, scale

_F82 = (6 / 7) ** 5  # Schlick's (1 - cos)^5 where cos = 1/7, about 82 degrees


@part
def lerp(a, b, s):
    """a + s (b - a), for colours a and b."""
    return a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2])


@part
def saturate(x):
    """x clamped to [0, 1]."""
    return min(max(x, F(0)), F(1))


@part
def towards_white(f0, s):
    """f0 + s (1 - f0), for a colour f0."""
    return lerp(f0, (F(1), F(1), F(1)), s)


@part
def refracted_cosine(cosine, ior):
    """Cosine of the angle between the refracted ray and the reversed normal; 0 for total internal reflection."""
    return math.sqrt(max(ior * ior - (F(1) - cosine * cosine), F(0))) / ior


@part
def dielectric(cosine, ior):
    """Reflectance of unpolarised light, by Fresnel's equations; 1 for total internal reflection."""
    c, t = abs(cosine), refracted_cosine(cosine, ior)
    if t == F(0):
        return F(1)
    s = (c - ior * t) / (c + ior * t)
    p = (ior * c - t) / (ior * c + t)
    return F(0.5) * (s * s + p * p)


@part
def dielectric_average(ior):
    """Reflectance averaged over projected solid angle, by the fit of Kulla and Conty 2017, as in Cycles."""
    if ior < F(1):
        return F(0.997118) + ior * (F(0.1014) - ior * (F(0.965241) + ior * F(0.130607)))
    return (ior - F(1)) / (F(4.08567) + F(1.00071) * ior)


@part
def normal_reflectance(ior):
    """Reflectance at normal incidence."""
    r = (ior - F(1)) / (ior + F(1))
    return r * r


@part
def ior_of(f0):
    """(1 + r) / (1 - r) with r = sqrt(f0): the ior above 1 whose reflectance at normal incidence is f0. f0 is clamped to 0..0.99."""
    r = math.sqrt(min(max(f0, F(0)), F(0.99)))
    return (F(1) + r) / (F(1) - r)


@part
def schlick_share(cosine, ior):
    """s = (R(cosine) - R(1)) / (1 - R(1)), for a dielectric's reflectance R. The reflectance is then `towards_white(f0, s)`."""
    f0 = normal_reflectance(ior)
    return saturate((dielectric(cosine, ior) - f0) / (F(1) - f0))


@part
def schlick_share_average(ior):
    """(R_avg - R(1)) / (1 - R(1)), with R_avg = `dielectric_average`."""
    f0 = normal_reflectance(ior)
    return saturate((dielectric_average(ior) - f0) / (F(1) - f0))


@part
def f82_lowering(f0, tint):
    """The b of `f82`: with it the reflectance at cos = 1/7, about 82 degrees, is tint times Schlick's curve (Kutz et al. 2021)."""
    schlick = towards_white(f0, F(_F82))
    b = scale(schlick, F(7 / (_F82 * 6 / 7)))
    return b[0] * (F(1) - tint[0]), b[1] * (F(1) - tint[1]), b[2] * (F(1) - tint[2])


@part
def f82(cosine, f0, b):
    """Reflectance of a metal, f0 + (1 - f0) (1 - cos)^5 - b cos (1 - cos)^6: Schlick's curve lowered by b."""
    s = saturate(F(1) - cosine)
    s5 = s * s * s * s * s
    r = towards_white(f0, s5)
    t = cosine * s5 * s
    return saturate(r[0] - b[0] * t), saturate(r[1] - b[1] * t), saturate(r[2] - b[2] * t)


@part
def f82_average(f0, b):
    """`f82` averaged over projected solid angle."""
    r = towards_white(f0, F(1 / 21))
    return r[0] - b[0] * F(1 / 126), r[1] - b[1] * F(1 / 126), r[2] - b[2] * F(1 / 126)
