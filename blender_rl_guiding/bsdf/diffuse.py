"""Lambert's diffuse reflection, f = albedo / pi. All lobes with cosine sampling use `sample` and `pdf` of this file."""

from ..kernels import part
from ..kernels.sampling import INV_PI, F, cosine_hemisphere, dot, scale, tangents, to_world
from .lobe import DIFFUSE, DIFFUSE_REFLECTION, NORMAL, WEIGHT, get, write


@part
def setup(lobes, k, point, n, color):
    """Write the lobe as row k."""
    write(lobes, k, DIFFUSE, DIFFUSE_REFLECTION, point, n, color, color)


@part
def evaluate(lobes, k, wi):
    """f |cos|, RGB; zero below the lobe's normal."""
    return scale(get(lobes, k, WEIGHT), pdf(lobes, k, wi))


@part
def sample(lobes, k, u, v):
    """A direction wi with the density of `pdf`."""
    n = get(lobes, k, NORMAL)
    tangent, bitangent = tangents(n)
    return to_world(tangent, bitangent, n, cosine_hemisphere(u, v))


@part
def pdf(lobes, k, wi):
    """Density of `sample`, per solid angle: cos / pi."""
    return max(dot(get(lobes, k, NORMAL), wi), F(0)) * INV_PI
