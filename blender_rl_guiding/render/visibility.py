"""Light on its way to a vertex: from lamps and the world that a ray meets, the visibility of emitters, and transparent shadows."""

import numpy as np

from ..bsdf import surface as bsdf
from ..kernels import part
from ..kernels.pointers import ref
from ..kernels.sampling import F, add, luminance, multiply, scale
from ..lights.lamp_shaders import lamp_light
from ..lights.lamps import HITTABLE, SHADOW, VISIBILITY
from ..lights.lamps import hit as hit_lamp
from ..lights.tree import crosses, inverse
from ..lights.world import world_pdf, world_radiance
from ..scene.ray_kinds import SHADOW as SHADOW_RAY
from ..shading.evaluate import run
from ..shading.operands import make_point
from ..tracing.geometry import FAR, U, V, closest, facing, hit_point, object_hit, occluded, off_surface

ZERO, ONE = (F(0), F(0), F(0)), (F(1), F(1), F(1))


@part
def lamps_met(stage, registers, start, ray, travelled, distance, pdf, kind, depth, nee):
    """Radiance from the lamps that a ray from `start` meets at distances travelled .. travelled + distance, RGB.

    pdf: density of the ray's direction, per solid angle. If `nee` and pdf > 0, each lamp has the MIS weight pdf / (pdf + pdf_light).
    """
    light, tree, over, i = ZERO, stage.lights.tree, inverse(ray), 0
    while i < tree.skip.shape[0]:
        if not crosses(tree, i, start, over, travelled + distance):
            i = tree.skip[i]
            continue
        k = np.int64(tree.lamp[i])
        if k >= 0:
            light = add(light, _lamp_met(stage, registers, k, start, ray, travelled, distance, pdf, kind, depth, nee))
        i += 1
    return light


@part
def _lamp_met(stage, registers, k, start, ray, travelled, distance, pdf, kind, depth, nee):
    lights = stage.lights
    if not np.int32(lights.lamps[k, VISIBILITY]) & kind:
        return ZERO
    met, light, pdf_lamp = hit_lamp(lights.lamps, k, start, ray)
    if met <= travelled or met > travelled + distance or pdf_lamp == F(0):
        return ZERO
    light = lamp_light(lights.lamps, stage.shading, registers, k, start, ray, met, light, depth)
    if nee and pdf > F(0):
        light = scale(light, pdf / (pdf + pdf_lamp * lights.probability[lights.triangle.shape[0] + k]))
    return light


@part
def surroundings(stage, registers, ray, pdf, kind, depth, nee):
    """Radiance from the world along `ray`, RGB. The MIS weight is that of `lamps_met`."""
    light = world_radiance(stage.shading, registers, ray, kind, depth)
    if nee and pdf > F(0) and stage.lights.world_probability > F(0):
        light = scale(light, pdf / (pdf + world_pdf(stage.lights.world, ray) * stage.lights.world_probability))
    return light


@part
def stands_alone(lights, emitter, pdf):
    """(whether rays cannot hit the emitter, so that light sampling has weight 1; whether objects block its light)."""
    k = emitter - lights.triangle.shape[0]
    if k < 0 or k >= lights.lamps.shape[0]:
        return False, True
    return pdf == F(0) or lights.lamps[k, HITTABLE] == F(0), lights.lamps[k, SHADOW] > F(0)


@part
def seen_by(stage, emitter):
    """The kinds of rays that see an emitter, as a bit mask."""
    triangles, lamps = stage.lights.triangle.shape[0], stage.lights.lamps.shape[0]
    if emitter < triangles:
        return stage.visibility[stage.surface.object[stage.lights.triangle[emitter]]]
    if emitter < triangles + lamps:
        return np.int64(stage.lights.lamps[emitter - triangles, VISIBILITY])
    return np.int64(stage.world_visibility)


@part
def passes_on(stage, passages, scratch, origin, wi, reach, depth):
    """The share of light that travels from the distance `reach` along wi to the origin, RGB.

    Without transparent surfaces in between it is 0 or 1. Light passes at most `passages` of these surfaces.
    """
    if not stage.any_see_through:
        return ZERO if occluded(stage.surface, scratch.rays, origin, wi, reach, SHADOW_RAY) else ONE
    rays, share, travelled = scratch.rays, ONE, F(0)
    for _ in range(passages + 1):
        triangle = closest(stage.surface, rays, origin, wi, F(0), reach, np.int64(SHADOW_RAY))
        if triangle < 0:
            return share
        shader = np.int64(stage.surface.material[triangle])
        if not stage.see_through[shader]:
            return ZERO
        step, u, v = rays.floats[FAR], rays.floats[U], rays.floats[V]
        object_, wo = object_hit(stage.surface, rays, triangle), scale(wi, F(-1))
        n, ng, behind = facing(stage.surface, rays, triangle, object_, wi)
        x, error = hit_point(stage.surface, triangle, object_, u, v)
        travelled += step
        point = ref(make_point(x, n, ng, wo, triangle, object_, u, v, behind, SHADOW_RAY, travelled, depth))
        run(stage.shading, shader, point, scratch.registers)
        share = multiply(share, bsdf.transparency(stage.shading, shader, point, scratch.registers))
        if luminance(share) <= F(0):
            return ZERO
        origin, reach = off_surface(x, scale(ng, F(-1)), error), reach - step - error  # or the ray would pass its end
    return ZERO
