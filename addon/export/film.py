"""How the render settings turn samples into pixels, and where they end paths."""

import bpy

from blender_rl_guiding.scene.description import Bounces, Film, Filter

_FILTERS: dict[str, Filter] = {"BOX": "box", "GAUSSIAN": "gaussian", "BLACKMAN_HARRIS": "blackman_harris"}


def read_film(scene: bpy.types.Scene) -> Film:
    """Cycles' settings; where Blender has been built or started without Cycles, those of `Film`."""
    transparent = scene.render.film_transparent
    if not hasattr(scene, "cycles"):
        return Film(transparent=transparent)
    cycles = scene.cycles
    kind = _FILTERS[cycles.pixel_filter_type]
    return Film(kind, 1.0 if kind == "box" else cycles.filter_width, cycles.film_exposure, transparent)


def read_bounces(scene: bpy.types.Scene) -> Bounces:
    """Scattering events, where Cycles counts bounces: its limit of N lets a path scatter N + 1 times, of each kind as of all.

    Transparent surfaces are passed N times. With a minimum of N, roulette is first played after N + 2 events.
    """
    if not hasattr(scene, "cycles"):
        return Bounces()
    cycles = scene.cycles
    return Bounces(
        total=cycles.max_bounces + 1,
        diffuse=cycles.diffuse_bounces + 1,
        glossy=cycles.glossy_bounces + 1,
        transmission=cycles.transmission_bounces + 1,
        transparent=cycles.transparent_max_bounces,
        roulette=cycles.min_light_bounces + 2,
    )
