"""The transport loop: one bounce of a wavefront of paths.

Symbols: L radiance at the camera, beta throughput, wo and wi local directions away from the surface, f the BSDF.
Estimates emission on both sides of surfaces, constant surroundings, and diffuse reflection, up to a number of scattering
events; with next-event estimation by the balance heuristic (Veach 1997). Not supported: transmission, media, delta lobes.
"""

import math

import numpy as np

from ..bsdf import diffuse
from ..guiding import directions as guide
from ..kernels import kernel
from ..sampling import (
    F,
    accumulate,
    add,
    dot,
    luminance,
    multiply,
    scale,
    store,
    subtract,
    tangents,
    to_local,
    to_world,
    uniform2,
    vector,
)
from ..scene.geometry import off_surface, shading_normal
from ..scene.lights import sample_light

DIMENSIONS = 8  # pairs of random numbers that a vertex may use; pair 0 of the first vertex is the pixel's
ZERO = (F(0), F(0), F(0))


@kernel
def bounce(scene, directions, settings, depth, count, paths, hits, following, shadow, transitions, counts, radiance):
    """Shade `count` paths at their hits and send the survivors on.

    scene: (surface, lights, world). settings: (max_bounces, nee, share of vertices that become transitions).
    hits: distance, triangle, u, v of each path. Writes `following`, `shadow`, `transitions` densely from 0 and their numbers to
    `counts`; adds emission to `radiance` (paths of the pass, 3).
    """
    surface, lights, world = scene
    max_bounces, nee, recorded_share = settings
    distance, triangle, hit_u, hit_v = hits
    survivors, shadows, recorded = 0, 0, 0
    learnable = max_bounces if nee else max_bounces + 1  # the last vertex has no next-event estimate to learn from
    for i in range(count):
        beta, ray, key = vector(paths.throughput, i), vector(paths.direction, i), paths.key[i]
        dimension = (depth + 1) * DIMENSIONS
        record = 0 < depth < learnable and uniform2(key, dimension)[0] < recorded_share

        # --- surroundings ------------------------------------------------------------------------------------------------
        if triangle[i] < 0:
            accumulate(radiance, paths.path[i], multiply(beta, world))
            if record:
                write_transition(transitions, recorded, paths, i, depth, max_bounces, ZERO, ZERO, luminance(world), F(0))
                recorded += 1
            continue

        # --- surface: x, n -------------------------------------------------------------------------------------------------
        face_normal = vector(surface.face_normal, triangle[i])
        n = shading_normal(surface, triangle[i], hit_u[i], hit_v[i])
        if dot(face_normal, ray) > F(0):
            face_normal, n = scale(face_normal, F(-1)), scale(n, F(-1))
        x = add(vector(paths.origin, i), scale(ray, distance[i]))
        material = surface.material[triangle[i]]
        albedo, emitted = vector(surface.albedo, material), vector(surface.emission, material)

        # --- emission, weighted against next-event estimation ----------------------------------------------------------------
        weight = F(1)
        if nee and depth > 0 and luminance(emitted) > F(0):
            pdf_light = lights.pdf_area[material] * distance[i] * distance[i] / -dot(face_normal, ray)
            weight = paths.pdf[i] / (paths.pdf[i] + pdf_light)
        Le = scale(emitted, weight)
        accumulate(radiance, paths.path[i], multiply(beta, Le))
        ends = depth == max_bounces or max(albedo[0], max(albedo[1], albedo[2])) == F(0)
        slot = -1
        if record:
            # The state goes on beyond the last bounce: what light arrives does not depend on how long this path may be.
            write_transition(transitions, recorded, paths, i, depth, max_bounces, x, n, luminance(Le), luminance(albedo))
            slot = recorded
            recorded += 1
        if ends:
            continue

        # --- local frame and guide --------------------------------------------------------------------------------------------
        t, b = tangents(n)
        wo = to_local(t, b, n, scale(ray, F(-1)))
        # Both kinds of ray start at one point, so that the weights of next-event estimation and of hits add up to one.
        origin = off_surface(x, face_normal, distance[i])
        cell = guide.find_cell(directions.cells, x, n) if directions.bsdf_fraction < F(1) else guide.UNKNOWN

        # --- next-event estimation --------------------------------------------------------------------------------------------
        if nee:
            u, _ = uniform2(key, dimension + 1)
            v, w = uniform2(key, dimension + 2)
            y, light = sample_light(lights, u, v, w)
            if next_event(scene, directions, cell, origin, n, face_normal, t, b, wo, albedo, y, light, beta, shadow, shadows):
                shadow.path[shadows] = paths.path[i]
                shadow.transition[shadows] = slot
                shadows += 1

        # --- next direction: beta f cos / pdf ------------------------------------------------------------------------------------
        u, v = uniform2(key, dimension + 3)
        choice, patch_choice = uniform2(key, dimension + 4)
        wi = guide.sample(directions, cell, wo, u, v, choice, patch_choice)
        pdf = guide.pdf(directions, cell, wo, wi)
        going = to_world(t, b, n, wi)
        if wi[2] <= F(0) or dot(going, face_normal) <= F(0) or pdf <= F(0):
            continue
        store(following.origin, survivors, origin)
        store(following.direction, survivors, going)
        store(following.throughput, survivors, multiply(beta, scale(diffuse.evaluate(albedo, wo, wi), wi[2] / pdf)))
        store(following.normal, survivors, n)
        following.pdf[survivors] = pdf
        following.key[survivors] = key
        following.path[survivors] = paths.path[i]
        survivors += 1
    counts[0], counts[1], counts[2] = survivors, shadows, recorded


@kernel
def next_event(scene, directions, cell, origin, n, face_normal, t, b, wo, albedo, y, light, beta, shadow, slot):
    """Write a shadow ray from origin to the point y on a light; False if nothing can arrive, whatever stands in between."""
    surface, lights, _ = scene
    triangle = lights.triangle[light]
    to_light = subtract(y, origin)
    squared = dot(to_light, to_light)
    distance = math.sqrt(squared)
    going = scale(to_light, F(1) / distance)
    wi = to_local(t, b, n, going)
    cosine = abs(dot(vector(surface.face_normal, triangle), going))
    if wi[2] <= F(0) or dot(going, face_normal) <= F(0) or cosine <= F(1e-6):
        return False
    material = surface.material[triangle]
    pdf_light = lights.pdf_area[material] * squared / cosine
    pdf_direction = guide.pdf(directions, cell, wo, wi)
    leaving = multiply(diffuse.evaluate(albedo, wo, wi), vector(surface.emission, material))
    leaving = scale(leaving, wi[2] / (pdf_light + pdf_direction))
    store(shadow.origin, slot, origin)
    store(shadow.direction, slot, going)
    shadow.distance[slot] = distance * F(1 - 1e-4)
    store(shadow.contribution, slot, multiply(beta, leaving))
    shadow.reward[slot] = luminance(leaving)
    return True


@kernel
def add_direct(count, visible, shadow, transitions, radiance):
    """Add the next-event estimates that arrive, to the image and to what is learnt."""
    for i in range(count):
        if visible[i] != 0:
            accumulate(radiance, shadow.path[i], vector(shadow.contribution, i))
            if shadow.transition[i] >= 0:
                transitions.reward[shadow.transition[i]] += shadow.reward[i]


@kernel
def write_transition(transitions, slot, paths, i, depth, max_bounces, y, next_normal, reward, albedo):
    """Store the segment that brought path i here."""
    transitions.order[slot] = paths.path[i] * np.int64(max_bounces + 1) + np.int64(depth)
    store(transitions.position, slot, vector(paths.origin, i))
    store(transitions.normal, slot, vector(paths.normal, i))
    store(transitions.direction, slot, vector(paths.direction, i))
    store(transitions.next_position, slot, y)
    store(transitions.next_normal, slot, next_normal)
    transitions.reward[slot] = reward
    transitions.albedo[slot] = albedo
