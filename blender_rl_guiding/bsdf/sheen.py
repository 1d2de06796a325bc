"""Sheen of fine fibres: a linearly transformed cosine (Zeltner, Burley and Chiang 2022), fitted to what Cycles renders.

In the local frame whose x axis points towards wo: if wi = (x, y, z), the vector (a x + b z, a y, z), normalized, has the density cos / pi.
"""

import math

from ..kernels import part
from ..kernels.sampling import INV_PI, F, circle, dot, normalize, scale, to_local, to_world
from .energy import sheen_fit
from .frames import frame
from .lobe import ALPHA_X, ALPHA_Y, APART, NORMAL, SHEEN, TANGENT, WEIGHT, get, put, write

_A, _B = ALPHA_X, ALPHA_Y  # columns


@part
def albedo(n, wo, roughness):
    """The share of light from wo that sheen scatters."""
    return sheen_fit(dot(n, wo), max(roughness, F(1e-3)))[2]


@part
def setup(lobes, k, point, n, color, roughness):
    """Write the lobe as row k."""
    a, b, share = sheen_fit(dot(n, point.wo), max(roughness, F(1e-3)))
    weight = scale(color, share)
    write(lobes, k, SHEEN, APART, point, n, weight, weight)
    lobes[k, _A] = a
    lobes[k, _B] = b
    put(lobes, k, TANGENT, frame(n, point.wo)[0])


@part
def _local(lobes, k, wi):
    n, tangent = get(lobes, k, NORMAL), get(lobes, k, TANGENT)
    _, bitangent = frame(n, tangent)
    return to_local(tangent, bitangent, n, wi)


@part
def evaluate(lobes, k, wi):
    """f |cos|, RGB; zero below the lobe's normal."""
    return scale(get(lobes, k, WEIGHT), pdf(lobes, k, wi))


@part
def sample(lobes, k, u, v):
    """A direction wi with the density of `pdf`."""
    a, b = lobes[k, _A], lobes[k, _B]
    r, z = math.sqrt(u), math.sqrt(F(1) - u)
    x, y = circle(v)
    x, y = r * x, r * y
    n, tangent = get(lobes, k, NORMAL), get(lobes, k, TANGENT)
    _, bitangent = frame(n, tangent)
    return to_world(tangent, bitangent, n, normalize(((x - b * z) / a, y / a, z)))


@part
def pdf(lobes, k, wi):
    """Density of `sample`, per solid angle."""
    a, b, (x, y, z) = lobes[k, _A], lobes[k, _B], _local(lobes, k, wi)
    if z <= F(0):
        return F(0)
    u, v = a * x + b * z, a * y
    t = a / (u * u + v * v + z * z)
    return INV_PI * z * t * t
