"""GGX microfacets: distribution of normals, Smith's masking, and sampling of the visible normals.

Sources: Walter et al. 2007; Heitz 2014, 2018; sampling after Dupuy and Benyoub 2023. Local frames have the macroscopic normal as +z.
"""

import math

from ..kernels import part
from ..kernels.sampling import INV_PI, PI, F, circle, normalize


@part
def smith(alpha2, cosine):
    """Smith's Lambda of a direction. cosine: between direction and normal; alpha2: alpha^2, with alpha the squared roughness."""
    tan2 = max(F(1) / (cosine * cosine) - F(1), F(0))
    return F(0.5) * (math.sqrt(F(1) + alpha2 * tan2) - F(1))


@part
def smith_anisotropic(alpha_x, alpha_y, v):
    """Smith's Lambda of the local direction v."""
    x, y = alpha_x * v[0], alpha_y * v[1]
    return F(0.5) * (math.sqrt(F(1) + (x * x + y * y) / (v[2] * v[2])) - F(1))


@part
def distribution(alpha2, sin2, cos2):
    """GGX's density D of microfacet normals at an angle with squared sine `sin2` and squared cosine `cos2`.

    sin2 is not computed as 1 - cos2, which has no correct digit at the narrow peak of a smooth surface.
    """
    t = sin2 + alpha2 * cos2
    return alpha2 / (PI * t * t)


@part
def distribution_anisotropic(alpha_x, alpha_y, h):
    """D of the local microfacet normal h."""
    x, y = h[0] / alpha_x, h[1] / alpha_y
    t = x * x + y * y + h[2] * h[2]
    return INV_PI / (alpha_x * alpha_y * t * t)


@part
def visible_normal(alpha_x, alpha_y, v, u1, u2):
    """A local microfacet normal with the density D max(v.h, 0) / (v.z (1 + Lambda(v))), for the local direction v above the surface.

    Stretching turns the surface into a sphere. There a visible normal is the half vector of v and a uniform point on a spherical cap.
    """
    stretched = normalize((alpha_x * v[0], alpha_y * v[1], v[2]))
    z = F(1) - u1 * (F(1) + stretched[2])
    r = math.sqrt(max(F(1) - z * z, F(0)))
    cosine, sine = circle(u2)
    x, y = r * cosine + stretched[0], r * sine + stretched[1]
    return normalize((alpha_x * x, alpha_y * y, max(z + stretched[2], F(1e-12))))
