"""The transport loop: it traces one path after another, from the camera to the light.

Symbols: L is the radiance at the camera, beta the throughput, x the position, n the shading normal, ng the normal of the triangle. wo and
wi point away from the surface. f is the BSDF times the cosine. The estimate is

    L = sum over the vertices of beta (emission w + next-event estimate),    beta <- beta f(wo, wi) / pdf(wi)

w is the MIS weight of emission against next-event estimation, by the balance heuristic (Veach 1997). A passage straight through a surface
is not a scattering event. Not supported: media, subsurface scattering.
"""

import math
from typing import NamedTuple

import numpy as np

from ..bsdf import surface as bsdf
from ..guiding import mixture
from ..kernels import kernel, merged, part
from ..kernels.pointers import ref
from ..kernels.sampling import F, add, dot, luminance, multiply, scale, store, stream, uniform2, vector
from ..scene.ray_kinds import CAMERA, DIFFUSE, GLOSSY, TRANSLUCENT, TRANSMISSION
from ..shading.evaluate import run
from ..shading.operands import make_point
from ..tracing.camera import camera_ray
from ..tracing.geometry import FAR, U, V, closest, facing, hit_point, object_hit, off_surface
from .film import add_sample, credit, hide, write_features
from .next_event import next_event
from .random_numbers import DIMENSIONS, DIRECTION, FILM, LENS, LOBE, PASSAGE, PATH
from .stage import RAYS, RECORDABLE, RECORDED
from .visibility import ONE, ZERO, lamps_met, surroundings

MOST_VERTICES = 4096  # most vertices of a path; passages through transparent surfaces count
MOST_LEARNT = 32  # most transitions that a path records; this bounds their memory


class Events(NamedTuple):
    """The number of scattering events of a path: the total, and for each kind of ray."""

    total: np.int64
    diffuse: np.int64
    glossy: np.int64
    transmission: np.int64


class Vertex(NamedTuple):
    """A point at which a path meets a surface."""

    x: tuple[F, F, F]
    error: F  # bound on the distance from x to the surface, caused by rounding
    n: tuple[F, F, F]
    ng: tuple[F, F, F]
    wo: tuple[F, F, F]
    triangle: np.int32
    object: np.int32
    u: F
    v: F


class Segment(NamedTuple):
    """The path from a vertex along wi to the next vertex with lobes that spread light. A complete segment can become a transition."""

    open: bool  # whether it may still become a transition
    n: tuple[F, F, F]
    wi: tuple[F, F, F]
    through: F  # share of light that is left after the surfaces on the segment
    reward: F  # sum over the light met so far: `through` times luminance


@kernel
def trace_pixels(stage, directions, limits, share, seed, pixels, first, end, first_sample, samples, scratch, film):
    """Trace samples first_sample .. first_sample + samples - 1 of pixels[first:end], and add them to the film in this order.

    About the share `share` of the vertices is recorded as transitions. Returns the first pixel with radiance that is not finite, or -1.
    """
    stage, directions, limits, scratch, film = ref(stage), ref(directions), ref(limits), ref(scratch), ref(film)
    scratch.counts[:] = 0
    bad = np.int64(-1)
    for place in range(first, end):
        pixel = pixels[place]
        for sample in range(first_sample, first_sample + samples):
            key = stream(seed, pixel, sample, limits.stratified)
            weight = F((sample + 1) ** limits.emphasis) if limits.emphasis > 0.0 else F(1)
            L = trace_path(stage, directions, limits, share, pixel, key, weight, scratch, film.passes)
            if not add_sample(film, pixel, L, weight) and bad < 0:
                bad = pixel
    return bad


@part
def trace_path(stage, directions, limits, share, pixel, key, weight, scratch, passes):
    """Trace one path. Returns its estimate of L, RGB. Adds its values, times `weight`, to the pixel's `passes`, if there are any."""
    rays, registers, lobes, counts = scratch.rays, scratch.registers, scratch.lobes, scratch.counts
    features = passes.shape[0] > 0
    learnable = limits.total if limits.nee else limits.total + 1  # with nee, the last vertex would lack its next-event estimate
    u, v = uniform2(key, FILM)
    lens_u, lens_v = uniform2(key, LENS)
    origin, ray, near, far = camera_ray(stage.lens, pixel % stage.width, pixel // stage.width, u, v, lens_u, lens_v)
    origin, near, far = add(origin, scale(ray, near)), F(0), far - near  # the ray length that shaders read starts at this origin
    L, beta, pdf, kind = ZERO, ONE, F(0), np.int64(CAMERA)
    start, travelled = origin, F(0)  # the last scattering vertex, at first the camera; the distance from it
    events, transparent = Events(np.int64(0), np.int64(0), np.int64(0), np.int64(0)), np.int64(0)
    segment, learnt = Segment(False, ZERO, ray, F(1), F(0)), 0
    seen = False  # whether the path has met a surface that it did not pass straight through

    for vertex in range(MOST_VERTICES):
        dimension = (vertex + 1) * DIMENSIONS
        triangle = closest(stage.surface, rays, origin, ray, near, far, kind)
        distance = rays.floats[FAR] if triangle >= 0 else F(np.inf)
        hit_u, hit_v = rays.floats[U], rays.floats[V]
        counts[RAYS] += 1
        counts[RECORDABLE] += segment.open
        learns = share > F(0) and segment.open and events.total < learnable and learnt < MOST_LEARNT
        recorded = learns and uniform2(key, dimension + PATH)[0] < share
        learnt += recorded

        # --- lamps on the way, and surroundings --------------------------------------------------------------------------
        light = lamps_met(stage, registers, start, ray, travelled, distance, pdf, kind, max(events.total, 1), limits.nee)
        if triangle < 0:
            hidden = limits.transparent_film and not seen
            if not hidden and stage.world_visibility & kind:
                light = add(light, surroundings(stage, registers, ray, pdf, kind, events.total, limits.nee))
            L = add(L, multiply(beta, light))
            if features:
                credit(passes, pixel, weight, multiply(beta, light), events.total)
                if hidden:
                    hide(passes, pixel, weight, beta)
            if recorded:
                write_transition(scratch, start, segment, ZERO, ZERO, segment.reward + segment.through * luminance(light), F(0))
            break

        # --- surface: x, n -----------------------------------------------------------------------------------------------
        wo = scale(ray, F(-1))
        shader, object_ = np.int64(stage.surface.material[triangle]), object_hit(stage.surface, rays, triangle)
        n, ng, behind = facing(stage.surface, rays, triangle, object_, ray)
        x, error = hit_point(stage.surface, triangle, object_, hit_u, hit_v)
        travelled += distance
        if stage.plain[shader]:
            lobes_count, emitted, passing = bsdf.scatter_plain(vector(stage.albedo, shader), n, lobes), ZERO, ZERO
        else:
            point = ref(make_point(x, n, ng, wo, triangle, object_, hit_u, hit_v, behind, kind, travelled, events.total))
            run(stage.shading, shader, point, registers)
            lobes_count, emitted, passing = bsdf.scatter(stage.shading, shader, point, registers, lobes)

        # --- emission, times its MIS weight w ---------------------------------------------------------------------------------
        if luminance(emitted) > F(0):
            w = F(1)
            if limits.nee and pdf > F(0):
                pdf_light = stage.lights.pdf_area[shader] * travelled * travelled / dot(ng, wo)
                w = pdf / (pdf + pdf_light)
            light = add(light, scale(emitted, w))
        L = add(L, multiply(beta, light))
        segment = met(segment, luminance(light))
        if features:
            credit(passes, pixel, weight, multiply(beta, light), events.total)
        colour = bsdf.albedo(lobes, lobes_count)

        # --- passing straight through -----------------------------------------------------------------------------------------
        straight, solid = luminance(passing), luminance(colour)
        chance_straight = straight / (straight + solid) if straight > F(0) else F(0)
        if transparent > 0 and transparent >= limits.transparent:  # as in Cycles: with limit 0 a path still passes once
            break
        if straight > F(0) and uniform2(key, dimension + PASSAGE)[0] < chance_straight:
            transparent += 1
            factor = scale(passing, F(1) / chance_straight)
            beta, segment = multiply(beta, factor), dimmed(segment, luminance(factor))
            origin, near, far = off_surface(x, scale(ng, F(-1)), error), F(0), far - distance
            continue
        beta = scale(beta, F(1) / (F(1) - chance_straight))
        if features and not seen:
            write_features(passes, pixel, weight, stage.lens.axes, stage.shading.origin, x, n, colour)
        seen = True

        # --- the segment to x is complete, unless all lobes of x are singular -------------------------------------------------
        scatters = bsdf.spreads(lobes, lobes_count)
        slot = np.int64(-1)
        if segment.open and (scatters or lobes_count == 0):
            if recorded:
                # The last bounce also has a next state: the light that arrives at x does not depend on the limits of this path.
                slot = write_transition(scratch, start, segment, x, n, segment.reward, segment.through * solid)
            segment = Segment(False, segment.n, segment.wi, segment.through, segment.reward)

        # --- the end of the path ---------------------------------------------------------------------------------------------
        if lobes_count == 0 or reached(limits, events):
            break
        if events.total > limits.roulette:
            survival = min(F(1), math.sqrt(max(beta[0], max(beta[1], beta[2]))))
            if uniform2(key, dimension + PATH)[1] >= survival:
                break
            beta = scale(beta, F(1) / survival)

        # --- next-event estimation -------------------------------------------------------------------------------------------
        found = mixture.find(directions, x, n, wo, lobes, lobes_count)
        if scatters and (limits.nee or limits.blind_lamps):
            passages = limits.transparent - transparent
            here = Vertex(x, error, n, ng, wo, triangle, object_, hit_u, hit_v)
            arriving = next_event(
                stage, directions, limits.nee, scratch, here, lobes_count, found, chance_straight, passages, events.total, key, dimension
            )
            L = add(L, multiply(beta, arriving))
            if features:
                credit(passes, pixel, weight, multiply(beta, arriving), events.total + 1)
            if slot >= 0:
                scratch.transitions.reward[slot] += luminance(arriving)

        # --- next direction: beta f / pdf ---------------------------------------------------------------------------------------
        # The shadow ray may have run other shaders, but `lobes` still holds the lobes of x.
        ray, label, factor, pdf = next_direction(directions, lobes, lobes_count, found, n, ng, wo, key, dimension)
        if luminance(factor) <= F(0):
            break
        beta = multiply(beta, factor)
        pdf *= F(1) - chance_straight

        # --- bookkeeping -----------------------------------------------------------------------------------------------------
        kind = label & (DIFFUSE | GLOSSY | TRANSMISSION | TRANSLUCENT)
        events = counted(events, kind)
        above_surface = dot(ng, ray) > F(0)
        origin = off_surface(x, ng if above_surface else scale(ng, F(-1)), error)
        near, far = F(0), F(np.inf)
        segment = dimmed(segment, luminance(factor)) if label & bsdf.SINGULAR else Segment(above_surface, n, ray, F(1), F(0))
        start, travelled = origin, F(0)
    return L


@merged
def next_direction(directions, lobes, count, found, n, ng, wo, key, dimension):
    """Draw wi. Returns (wi, label, f / pdf, pdf). `bsdf.sample` explains the label.

    The pdf is 0 if wi has no density. f / pdf is zero if the path ends.
    """
    u, v = uniform2(key, dimension + DIRECTION)
    lobe, rest = np.int64(0), F(0)
    if count > 1 or found.share > F(0):
        lobe, rest = bsdf.pick(lobes, count, uniform2(key, dimension + LOBE)[0])
    if mixture.takes(directions, found, lobes, lobe, rest):
        wi = mixture.sample(directions, found, n, wo, u, v, uniform2(key, dimension + PASSAGE)[1])
        label = bsdf.reflection(lobes, lobe, mixture.reach(directions)) if dot(ng, wi) > F(0) else np.int64(0)
    else:
        wi, label = bsdf.sample(lobes, lobe, ng, wo, u, v, uniform2(key, dimension + LOBE)[1])
    if label == 0:
        return wi, label, ZERO, F(0)
    if label & bsdf.SINGULAR:
        return wi, label, scale(bsdf.singular(lobes, lobe, ng, wo, wi, label), F(1) / bsdf.chance(lobes, lobe)), F(0)
    f, pdf, pdf_within = bsdf.evaluate(lobes, count, ng, wo, wi, mixture.reach(directions))
    pdf = mixture.pdf(directions, found, n, wo, wi, pdf, pdf_within)
    return wi, label, scale(f, F(1) / pdf) if pdf > F(0) else ZERO, pdf


@part
def reached(limits, events):
    """Whether the path has reached a limit, so that it must not scatter again."""
    if events.total >= limits.total or events.diffuse >= limits.diffuse:
        return True
    return events.glossy >= limits.glossy or events.transmission >= limits.transmission


@part
def counted(events, kind):
    """The events plus one event that makes a ray of this kind."""
    transmitted = (kind & (TRANSMISSION | TRANSLUCENT)) > 0
    return Events(events.total + 1, events.diffuse + (kind == DIFFUSE), events.glossy + (kind == GLOSSY), events.transmission + transmitted)


@part
def met(segment, light):
    """The segment after it has met light of the luminance `light`."""
    return Segment(segment.open, segment.n, segment.wi, segment.through, segment.reward + segment.through * light)


@part
def dimmed(segment, factor):
    """The segment after a surface that multiplies the light by `factor`."""
    return Segment(segment.open, segment.n, segment.wi, segment.through * factor, segment.reward)


@part
def write_transition(scratch, x, segment, y, next_normal, reward, albedo):
    """Store the segment from x to y as a transition. Returns the row."""
    transitions, slot = scratch.transitions, scratch.counts[RECORDED]
    store(transitions.position, slot, x)
    store(transitions.normal, slot, segment.n)
    store(transitions.direction, slot, segment.wi)
    store(transitions.next_position, slot, y)
    store(transitions.next_normal, slot, next_normal)
    transitions.reward[slot] = reward
    transitions.albedo[slot] = albedo
    scratch.counts[RECORDED] += 1
    return slot
