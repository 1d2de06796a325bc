"""The sun of the Sky Texture node."""

import math

from ..kernels import part
from ..kernels.sampling import F, add, dot, scale, subtract
from .textures import INTERPOLATE, ramp

LIMB = F(0.6)  # 1 - brightness of the disc's edge / brightness of its middle


@part
def sun_disc(tables, d, sky, elevation, size, intensity, table, hides):
    """The colour of `sky` with the disc of a sun, in direction d. The sun is above +y; for the arguments see `scene.ops`."""
    sun = (F(0), math.cos(elevation), math.sin(elevation))
    aside, along = subtract(d, sun), add(d, sun)
    # The angle to the sun is 2 arctan(|d - sun| / |d + sun|), which is accurate for very small angles, too.
    reach = math.tan(F(0.25) * size)
    if dot(aside, aside) >= reach * reach * dot(along, along):
        return sky
    r = F(4) * math.atan2(math.sqrt(dot(aside, aside)), math.sqrt(dot(along, along))) / size
    y = (math.asin(min(max(d[2], F(-1)), F(1))) - elevation) / size + F(0.5)
    darker = F(1) - LIMB * (F(1) - math.sqrt(max(F(0), F(1) - r * r)))
    disc = scale(ramp(tables, y, table, INTERPOLATE), intensity * darker)
    if hides:
        return disc if dot(disc, disc) > F(0) else sky
    return add(sky, disc)
