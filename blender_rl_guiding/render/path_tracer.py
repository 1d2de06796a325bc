"""The transport loop: paths from the camera to the light, one after another.

Symbols: L radiance at the camera, beta throughput, x position, n shading normal, wo and wi directions away from the surface, f the
BSDF times the cosine. Emission is found by next-event estimation and by chance, weighed by the balance heuristic (Veach 1997); what
lets light pass straight is no scattering event. Not supported: media, subsurface scattering.
"""

import math

import numpy as np

from ..bsdf import surface as bsdf
from ..guiding import directions as guide
from ..kernels import kernel, part
from ..kernels.pointers import ref
from ..kernels.sampling import F, add, dot, finer, luminance, multiply, scale, store, stream, tangents, to_local, to_world, uniform2, vector
from ..lights.emitters import sample_light
from ..scene.ray_kinds import CAMERA, DIFFUSE, GLOSSY, TRANSLUCENT, TRANSMISSION
from ..shading.evaluate import run
from ..shading.operands import make_point
from ..tracing.camera import camera_ray
from ..tracing.geometry import FAR, U, V, closest, facing, hit_point, object_hit, off_surface
from ..tracing.terminator import shadow_ray
from .visibility import ONE, ZERO, lamps_met, passes_on, seen_by, stands_alone, surroundings

# Pairs of random numbers. Every choice has a number of its own, so that each is stratified, and none depends on another.
FILM, LENS = 0, 1  # of the camera
DIMENSIONS = 8  # that a vertex may use, after as many of the camera
PATH, EMITTER, LIGHT, DIRECTION, LOBE, PASSAGE = range(6)  # of a vertex:
# (is it recorded, does roulette end the path), (which emitter), where on it, wi, (which lobe, does it refract), (straight on, which patch)
MOST_VERTICES = 4096  # of a path, passages through transparent surfaces included
MOST_LEARNT = 32  # transitions of a path, which bounds the memory for them
# Columns of the passes that are written beside the radiance.
ALPHA, DEPTH, ALBEDO, SHADING_NORMAL, POSITION, EMISSION, DIRECT, PASS_COLUMNS = 0, 1, 2, 5, 8, 11, 14, 17


@kernel
def trace_pixels(stage, directions, limits, share, seed, pixels, first, end, first_sample, samples, scratch, film):
    """Trace samples first_sample .. first_sample + samples - 1 of pixels[first:end], and add them to the film in their order.

    About `share` of the vertices become transitions. Returns the first pixel that received radiance which is not finite, or -1.
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
def add_sample(film, pixel, L, weight):
    """Add a sample to its pixel's sums; whether it is finite."""
    w = np.float64(weight)
    for c in range(3):
        value = np.float64(L[c])
        film.sum[pixel, c] += w * value
        film.squares[pixel, c] += w * value * value
    film.samples[pixel] += 1
    film.weight[pixel] += w
    return np.isfinite(L[0] + L[1] + L[2])


@part
def trace_path(stage, directions, limits, share, pixel, key, weight, scratch, passes):
    """One path from the camera to its end: the radiance that it brings, RGB. Adds `weight` times the pixel's `passes` if there are any."""
    rays, registers, lobes, transitions, counts = scratch.rays, scratch.registers, scratch.lobes, scratch.transitions, scratch.counts
    features = passes.shape[0] > 0
    learnable = limits.total if limits.nee else limits.total + 1  # the last vertex has no next-event estimate to learn from
    seek = limits.nee or limits.blind_lamps
    u, v = uniform2(key, FILM)
    lens_u, lens_v = uniform2(key, LENS)
    origin, ray, near, far = camera_ray(stage.lens, pixel % stage.width, pixel // stage.width, u, v, lens_u, lens_v)
    origin, near, far = add(origin, scale(ray, near)), F(0), far - near  # shaders count the ray's length from here on
    L, beta, pdf, kind = ZERO, ONE, F(0), np.int64(CAMERA)
    start, start_normal, segment_ray, travelled = origin, ZERO, ray, F(0)  # where the path scattered last, and how far it is from there
    through, reward, segment, learnt = F(1), F(0), False, 0  # of the segment to be learnt: what passes along it, what it has met so far
    scattered = diffuse = glossy = transmission = transparent = np.int64(0)
    seen = False  # whether the camera's first surface has been met

    for vertex in range(MOST_VERTICES):
        dimension = (vertex + 1) * DIMENSIONS
        triangle = closest(stage.surface, rays, origin, ray, near, far, kind)
        distance = rays.floats[FAR] if triangle >= 0 else F(np.inf)
        hit_u, hit_v = rays.floats[U], rays.floats[V]
        counts[0] += 1
        learns = share > F(0) and segment and scattered < learnable and learnt < MOST_LEARNT
        recorded = learns and uniform2(key, dimension + PATH)[0] < share
        counts[1] += segment
        learnt += recorded

        # --- lamps on the way, and surroundings --------------------------------------------------------------------------
        light = lamps_met(stage, registers, start, ray, travelled, distance, pdf, kind, max(scattered, 1), limits.nee)
        if triangle < 0:
            hidden = limits.transparent_film and not seen
            if not hidden and stage.world_visibility & kind:
                light = add(light, surroundings(stage, registers, ray, pdf, kind, scattered, limits.nee))
            L = add(L, multiply(beta, light))
            if features:
                credit(passes, pixel, weight, multiply(beta, light), scattered)
                if hidden:
                    passes[pixel, ALPHA] += weight * (beta[0] + beta[1] + beta[2]) * F(1 / 3)
            if recorded:
                reward += through * luminance(light)
                write_transition(transitions, counts, start, start_normal, segment_ray, ZERO, ZERO, reward, F(0))
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
            point = ref(make_point(x, n, ng, wo, triangle, object_, hit_u, hit_v, behind, kind, travelled, scattered))
            run(stage.shading, shader, point, registers)
            lobes_count, emitted, passing = bsdf.scatter(stage.shading, shader, point, registers, lobes)

        # --- emission, weighed against next-event estimation ---------------------------------------------------------------
        if luminance(emitted) > F(0):
            mis = F(1)
            if limits.nee and pdf > F(0):
                pdf_light = stage.lights.pdf_area[shader] * travelled * travelled / dot(ng, wo)
                mis = pdf / (pdf + pdf_light)
            light = add(light, scale(emitted, mis))
        L = add(L, multiply(beta, light))
        reward += through * luminance(light)
        if features:
            credit(passes, pixel, weight, multiply(beta, light), scattered)
        colour = bsdf.albedo(lobes, lobes_count)

        # --- passing straight ------------------------------------------------------------------------------------------------
        straight, solid = luminance(passing), luminance(colour)
        chance_straight = straight / (straight + solid) if straight > F(0) else F(0)
        if transparent > 0 and transparent >= limits.transparent:  # as in Cycles: where the limit is none, a path passes once all the same
            break
        if straight > F(0) and uniform2(key, dimension + PASSAGE)[0] < chance_straight:
            transparent += 1
            factor = scale(passing, F(1) / chance_straight)
            beta, through = multiply(beta, factor), through * luminance(factor)
            origin, near, far = off_surface(x, scale(ng, F(-1)), error), F(0), far - distance
            continue
        beta = scale(beta, F(1) / (F(1) - chance_straight))
        if features and not seen:
            write_features(passes, pixel, weight, stage, x, n, colour)
        seen = True

        # --- the segment that led here is complete, unless light can arrive from one direction only ------------------------------
        scatters = bsdf.spreads(lobes, lobes_count)
        slot = np.int64(-1)
        if segment and (scatters or lobes_count == 0):
            if recorded:
                slot = counts[2]
                # The state goes on beyond the last bounce: what light arrives does not depend on how long this path may be.
                write_transition(transitions, counts, start, start_normal, segment_ray, x, n, reward, through * solid)
            segment = False

        # --- the end of the path ---------------------------------------------------------------------------------------------
        if lobes_count == 0 or scattered >= limits.total or diffuse >= limits.diffuse or glossy >= limits.glossy:
            break
        if transmission >= limits.transmission:
            break
        if scattered > limits.roulette:
            survival = min(F(1), math.sqrt(max(beta[0], max(beta[1], beta[2]))))
            if uniform2(key, dimension + PATH)[1] >= survival:
                break
            beta = scale(beta, F(1) / survival)

        # --- next-event estimation -------------------------------------------------------------------------------------------
        guided, cell = F(0), guide.UNKNOWN
        if directions.bsdf_fraction < F(1):
            cell = guide.find_cell(directions.cells, x, n)
            if cell != guide.UNKNOWN:
                guided = (F(1) - directions.bsdf_fraction) * bsdf.guidable(lobes, lobes_count)
        if seek and scatters:
            u, v = uniform2(key, dimension + LIGHT)
            choice = finer(*uniform2(key, dimension + EMITTER))
            # Both kinds of ray start at one point, so that the weights of next-event estimation and of hits add up to one.
            above = off_surface(x, ng, error)
            wi, far_light, arriving, pdf_light, emitter = sample_light(
                stage.lights, stage.shading, stage.surface, registers, above, scattered + 1, choice, u, v
            )
            alone, shadow = stands_alone(stage.lights, emitter, pdf_light)
            if (limits.nee or alone) and luminance(arriving) > F(0):
                f, pdf_wi, pdf_guidable = bsdf.evaluate_seen(lobes, lobes_count, ng, wo, wi, seen_by(stage, emitter))
                if luminance(f) > F(0):
                    if alone:
                        arriving = scale(arriving, F(1) / pdf_light) if pdf_light > F(0) else arriving
                    else:
                        if guided > F(0) and dot(ng, wi) > F(0):
                            pdf_wi += mixed(directions, cell, n, wi, guided, pdf_guidable)
                        arriving = scale(arriving, F(1) / (pdf_light + pdf_wi * (F(1) - chance_straight)))
                    if shadow:
                        counts[0] += 1
                        from_x, to_light, reach = shadow_ray(stage.surface, triangle, object_, hit_u, hit_v, x, error, n, ng, wi, far_light)
                        arriving = multiply(
                            arriving, passes_on(stage, limits.transparent - transparent, scratch, from_x, to_light, reach, scattered + 1)
                        )
                    leaving = multiply(f, arriving)
                    L = add(L, multiply(beta, leaving))
                    if features:
                        credit(passes, pixel, weight, multiply(beta, leaving), scattered + 1)
                    if slot >= 0:
                        transitions.reward[slot] += luminance(leaving)

        # --- next direction: beta f / pdf ---------------------------------------------------------------------------------------
        # Looking towards the light may have run other shaders, but the lobes are still those of x.
        u, v = uniform2(key, dimension + DIRECTION)
        lobe, rest = np.int64(0), F(0)
        if lobes_count > 1 or guided > F(0):
            lobe, rest = bsdf.pick(lobes, lobes_count, uniform2(key, dimension + LOBE)[0])
        if guided > F(0) and bsdf.is_guidable(lobes, lobe) and rest >= directions.bsdf_fraction:
            t, b = tangents(n)
            patch_choice = uniform2(key, dimension + PASSAGE)[1]
            ray = to_world(t, b, n, guide.sample_table(directions, cell, u, v, patch_choice))
            label = np.int64(DIFFUSE if dot(ng, ray) > F(0) else 0)
        else:
            ray, label = bsdf.sample(lobes, lobe, ng, wo, u, v, uniform2(key, dimension + LOBE)[1])
        if label == 0:
            break
        if label & bsdf.SINGULAR:
            factor = scale(bsdf.singular(lobes, lobe, ng, wo, ray, label), F(1) / bsdf.chance(lobes, lobe))
            pdf = F(0)
        else:
            f, pdf, pdf_guidable = bsdf.evaluate(lobes, lobes_count, ng, wo, ray)
            if guided > F(0):
                pdf += mixed(directions, cell, n, ray, guided, pdf_guidable)
            if pdf <= F(0):
                break
            factor = scale(f, F(1) / pdf)
            pdf *= F(1) - chance_straight
        if luminance(factor) <= F(0):
            break
        beta = multiply(beta, factor)

        # --- bookkeeping -----------------------------------------------------------------------------------------------------
        scattered += 1
        kind = label & (DIFFUSE | GLOSSY | TRANSMISSION | TRANSLUCENT)
        diffuse += kind == DIFFUSE
        glossy += kind == GLOSSY
        transmission += (kind & (TRANSMISSION | TRANSLUCENT)) > 0
        above_surface = dot(ng, ray) > F(0)
        origin = off_surface(x, ng if above_surface else scale(ng, F(-1)), error)
        near, far = F(0), F(np.inf)
        if label & bsdf.SINGULAR:
            through *= luminance(factor)
        else:
            segment = above_surface
            segment_ray, start_normal, through, reward = ray, n, F(1), F(0)
        start, travelled = origin, F(0)
    return L


@part
def mixed(directions, cell, n, wi, guided, pdf_guidable):
    """What the pdf of the material's own sampling changes by, where the guide takes over a part of its diffuse share."""
    t, b = tangents(n)
    return guided * guide.table_pdf(directions, cell, to_local(t, b, n, wi)) - (F(1) - directions.bsdf_fraction) * pdf_guidable


@part
def credit(passes, pixel, weight, light, scattered):
    """Count light to the pass of emission or direct light, by the scattering events that it needed."""
    if scattered <= 1:
        column = EMISSION if scattered == 0 else DIRECT
        for c in range(3):
            passes[pixel, column + c] += weight * light[c]


@part
def write_features(passes, pixel, weight, stage, x, n, colour):
    """The passes of the first surface."""
    for c in range(3):
        passes[pixel, ALBEDO + c] += weight * colour[c]
        passes[pixel, SHADING_NORMAL + c] += weight * n[c]
        passes[pixel, POSITION + c] += weight * (stage.shading.origin[c] + x[c])
    a = stage.lens.axes
    passes[pixel, DEPTH] += weight * ((a[3, 0] - x[0]) * a[2, 0] + (a[3, 1] - x[1]) * a[2, 1] + (a[3, 2] - x[2]) * a[2, 2])


@part
def write_transition(transitions, counts, x, n, wi, y, next_normal, reward, albedo):
    """Store a segment from x along wi to y."""
    slot = counts[2]
    store(transitions.position, slot, x)
    store(transitions.normal, slot, n)
    store(transitions.direction, slot, wi)
    store(transitions.next_position, slot, y)
    store(transitions.next_normal, slot, next_normal)
    transitions.reward[slot] = reward
    transitions.albedo[slot] = albedo
    counts[2] += 1
