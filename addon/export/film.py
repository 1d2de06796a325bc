"""Render settings of the film, and limits of bounces."""

import bpy

from blender_rl_guiding.scene.description import Bounces, Film, Filter

_FILTERS: dict[str, Filter] = {"BOX": "box", "GAUSSIAN": "gaussian", "BLACKMAN_HARRIS": "blackman_harris"}


def read_film(scene: bpy.types.Scene) -> Film:
    """The film from Cycles' settings; the defaults of `Film` in a Blender without Cycles."""
    transparent = scene.render.film_transparent
    if not hasattr(scene, "cycles"):
        return Film(transparent=transparent)
    cycles = scene.cycles
    kind = _FILTERS[cycles.pixel_filter_type]
    return Film(kind, 1.0 if kind == "box" else cycles.filter_width, cycles.film_exposure, transparent)


def read_bounces(scene: bpy.types.Scene) -> Bounces:
    """Limits of scattering events: a limit of N bounces in Cycles is N + 1 events here, for each kind and for the total.

    A path passes at most N transparent surfaces. With a minimum of N bounces, roulette begins after N + 2 events.
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
