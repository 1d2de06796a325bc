"""The scene as the kernels read it, and the memory of one thread."""

from typing import NamedTuple

import numpy as np

from ..bsdf.surface import COLUMNS, LOBES
from ..guiding.base import Transitions, empty_transitions
from ..lights.emitters import Lights, lights
from ..lights.lamps import HITTABLE
from ..scene.data import SceneData
from ..scene.description import CLOSURES
from ..scene.ray_kinds import EMITTERS, WORLD, seen_by
from ..settings import Render
from ..shading.operands import KINDS, NONE, REGISTERS, Shading
from ..shading.program import compile_shaders
from ..tracing.camera import Lens, lens
from ..tracing.geometry import Geometry, Rays, Surface, rays

ALPHA = list(CLOSURES["principled"]).index("alpha")


class Stage(NamedTuple):
    """The scene in the form that kernels read."""

    lens: Lens
    surface: Surface
    shading: Shading
    lights: Lights
    plain: np.ndarray  # (S,) bool, whether a shader is only a Lambert reflection of constant colour
    albedo: np.ndarray  # (S, 3) float32, of plain shaders
    see_through: np.ndarray  # (S,) bool, whether a shader may let light pass straight through
    any_see_through: bool
    visibility: np.ndarray  # (O,) int64, kinds of rays that see what an object emits
    world_visibility: int  # kinds of rays that see the world
    width: int  # pixels


class Limits(NamedTuple):
    """The limits of a path's length, and the options of sampling."""

    total: int
    diffuse: int
    glossy: int
    transmission: int
    transparent: int
    roulette: int  # number of scattering events before Russian roulette begins
    nee: bool
    blind_lamps: bool  # whether the scene has lamps that only next-event estimation can find
    transparent_film: bool
    emphasis: np.float64  # sample i of a pixel has the weight i^emphasis
    stratified: bool  # whether the random numbers of a pixel's samples are stratified


RAYS, RECORDABLE, RECORDED = 0, 1, 2  # indices of `Scratch.counts`: rays cast, vertices that could be recorded, transitions


class Scratch(NamedTuple):
    """The working memory of one thread."""

    rays: Rays
    registers: np.ndarray  # (256, 3) float32
    lobes: np.ndarray  # (LOBES, COLUMNS) float32
    transitions: Transitions
    counts: np.ndarray  # (3,) int64, see RAYS


@np.errstate(over="ignore", divide="ignore", invalid="ignore")  # `add_sample` finds radiance that is not finite
def build_stage(scene: SceneData) -> tuple[Stage, Geometry]:
    """The stage, and Embree's geometry, which must live as long as the stage.

    InputError if a shader cannot be compiled, Embree cannot hold the triangles, or the power of a light is infinite.
    """
    shading = compile_shaders(scene)
    geometry = Geometry(scene)
    see_through = np.array([_sees_through(shading, s) for s in range(len(scene.shaders))], bool)
    plain, albedo = _plain(shading)
    found = lights(scene, shading, geometry.surface)
    stage = Stage(
        lens(scene),
        geometry.surface,
        shading,
        found,
        plain,
        albedo,
        see_through,
        bool(see_through.any()),
        seen_by(scene.visibility, EMITTERS),
        seen_by(scene.world_visibility, WORLD),
        scene.camera.width,
    )
    return stage, geometry


def _plain(shading: Shading) -> tuple[np.ndarray, np.ndarray]:
    """Which shaders are only a Lambert reflection of constant colour, (S,) bool, and their albedos, (S, 3). The loop skips their code."""
    plain, albedo = np.zeros(len(shading.shaders), bool), np.zeros((len(shading.shaders), 3), np.float32)
    for k, (first, end) in enumerate(shading.shaders[:, 2:]):
        kinds = [KINDS[row[0]] for row in shading.closures[first:end]]
        weight, color, roughness, normal = shading.closures[first, 1:5] if kinds == ["diffuse"] else (NONE, NONE, NONE, NONE)
        if min(weight, color, roughness) >= 0 and normal == NONE and shading.constants[roughness, 0] == 0:
            plain[k], albedo[k] = True, shading.constants[weight].clip(0) * shading.constants[color].clip(0)
    return plain, albedo


def _sees_through(shading: Shading, shader: int) -> bool:
    first, end = shading.shaders[shader, 2:]
    return any(
        KINDS[row[0]] == "transparent" or (KINDS[row[0]] == "principled" and _has_alpha(shading, row))
        for row in shading.closures[first:end]
    )


def _has_alpha(shading: Shading, row: np.ndarray) -> bool:
    operand = row[2 + ALPHA]
    return operand < 0 or shading.constants[operand, 0] < 1


def limits(scene: SceneData, settings: Render, stage: Stage) -> Limits:
    """The scene's limits. If `settings.max_bounces` >= 0, it replaces the limit of the total and of each kind of bounce."""
    bounces, most = scene.bounces, settings.max_bounces
    kinds = (bounces.total, bounces.diffuse, bounces.glossy, bounces.transmission) if most < 0 else (most, most, most, most)
    blind = bool((stage.lights.lamps[:, HITTABLE] == 0).any())
    lit = bool(stage.lights.probability.any())
    modes = settings.nee and lit, blind and lit, scene.film.transparent
    return Limits(*kinds, bounces.transparent, bounces.roulette, *modes, np.float64(settings.emphasis), settings.sampler == "stratified")


def wants_passes(scene: SceneData, settings: Render) -> bool:
    """Whether the film needs passes besides the radiance."""
    return settings.passes or settings.denoise or scene.film.transparent


def scratch(transitions: int) -> Scratch:
    """The memory of one thread. transitions: the most transitions that the thread records in one call."""
    return Scratch(
        rays(),
        np.zeros((REGISTERS, 3), np.float32),
        np.zeros((LOBES, COLUMNS), np.float32),
        empty_transitions(transitions),
        np.zeros(3, np.int64),
    )
