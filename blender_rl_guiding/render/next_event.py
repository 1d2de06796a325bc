"""Next-event estimation: draw a point on a light, and estimate the light that travels from there to a vertex."""

from ..bsdf import surface as bsdf
from ..guiding import mixture
from ..kernels import merged
from ..kernels.sampling import F, dot, finer, luminance, multiply, scale, uniform2
from ..lights.emitters import sample_light
from ..tracing.geometry import off_surface
from ..tracing.terminator import shadow_ray
from .random_numbers import EMITTER, LIGHT
from .stage import RAYS
from .visibility import ZERO, passes_on, seen_by, stands_alone


@merged
def next_event(stage, directions, nee, scratch, here, lobes_count, found, chance_straight, passages, scattered, key, dimension):
    """An estimate of the direct light that a vertex scatters towards wo, RGB, times its MIS weight.

        f Le V / (pdf_light + pdf (1 - chance_straight)),    and f Le V / pdf_light for lights that rays cannot hit.

    Le is the radiance by `sample_light`. V is the share of light that objects on the way let through. If pdf_light = 0, the estimate is
    f Le V; see `sample_light`.

    nee: if true, all lights count; if false, only lights that rays cannot hit.
    here: the vertex. lobes_count: the number of its lobes in `scratch`. found: the result of `mixture.find` at the vertex.
    chance_straight: the probability that the path passes straight through the vertex.
    passages: how many more transparent surfaces light may pass on its way to the vertex.
    scattered: the number of scattering events before the vertex.
    key: the stream of the path's random numbers. dimension: the vertex's first pair in this stream.
    """
    lobes, x, n, ng, wo = scratch.lobes, here.x, here.n, here.ng, here.wo
    u, v = uniform2(key, dimension + LIGHT)
    choice = finer(*uniform2(key, dimension + EMITTER))
    # The light is sampled from the point where scattered rays start. So the MIS weights of light sampling and of hits add up to one.
    above = off_surface(x, ng, here.error)
    wi, far, light, pdf_light, emitter = sample_light(
        stage.lights, stage.shading, stage.surface, scratch.registers, above, scattered + 1, choice, u, v
    )
    alone, shadow = stands_alone(stage.lights, emitter, pdf_light)
    if not (nee or alone) or not luminance(light) > F(0):
        return ZERO
    f, pdf, pdf_within = bsdf.evaluate_seen(lobes, lobes_count, ng, wo, wi, mixture.reach(directions), seen_by(stage, emitter))
    if not luminance(f) > F(0):
        return ZERO
    if alone:
        light = scale(light, F(1) / pdf_light) if pdf_light > F(0) else light
    else:
        if dot(ng, wi) > F(0):
            pdf = mixture.pdf(directions, found, n, wo, wi, pdf, pdf_within)
        light = scale(light, F(1) / (pdf_light + pdf * (F(1) - chance_straight)))
    if shadow:
        scratch.counts[RAYS] += 1
        from_x, to_light, reach = shadow_ray(stage.surface, here.triangle, here.object, here.u, here.v, x, here.error, n, ng, wi, far)
        light = multiply(light, passes_on(stage, passages, scratch, from_x, to_light, reach, scattered + 1))
    return multiply(f, light)
