"""Lambert's diffuse reflection: f = albedo / pi."""

from ..kernels import kernel
from ..sampling import INV_PI, F, cosine_hemisphere, scale


@kernel
def evaluate(albedo, wo, wi):
    """f(wo, wi), RGB in 1/sr; zero below the surface."""
    return scale(albedo, INV_PI if wi[2] > F(0) else F(0))


@kernel
def sample(wo, u, v):
    """A direction wi with the density of `pdf`."""
    return cosine_hemisphere(u, v)


@kernel
def pdf(wo, wi):
    """Density of `sample`, per solid angle."""
    return max(wi[2], F(0)) * INV_PI
