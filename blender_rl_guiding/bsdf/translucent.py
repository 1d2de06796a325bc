"""Diffuse transmission: Lambert's lobe on the far side."""

from ..kernels import part
from ..kernels.sampling import INV_PI, F, dot, scale
from . import diffuse
from .lobe import APART, NORMAL, TRANSLUCENT, WEIGHT, get, write


@part
def setup(lobes, k, point, n, color):
    """Write the lobe as row k."""
    write(lobes, k, TRANSLUCENT, APART, point, n, color, color)


@part
def evaluate(lobes, k, wi):
    """f |cos|, RGB; zero above the lobe's normal."""
    return scale(get(lobes, k, WEIGHT), pdf(lobes, k, wi))


@part
def sample(lobes, k, u, v):
    """A direction wi with the density of `pdf`."""
    return scale(diffuse.sample(lobes, k, u, v), F(-1))


@part
def pdf(lobes, k, wi):
    """Density of `sample`, per solid angle."""
    return max(-dot(get(lobes, k, NORMAL), wi), F(0)) * INV_PI
