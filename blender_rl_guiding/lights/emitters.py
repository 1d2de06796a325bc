"""All lights in one discrete distribution: emitting triangles, then lamps, then the world, each in proportion to its power."""

from typing import NamedTuple

import numpy as np

from ..bsdf.surface import emission
from ..errors import InputError
from ..kernels import kernel, part
from ..kernels.pointers import ref
from ..kernels.sampling import LUMINANCE, F, add, dot, scale, stream, subtract, uniform2, uniform_triangle, vector
from ..scene.data import SceneData
from ..scene.description import CLOSURES, Shader, emits
from ..shading.evaluate import run
from ..shading.operands import KINDS, REGISTERS, Shading, make_point
from ..tracing.geometry import shading_normal
from .inverse import Inverse, draw, inverse_table
from .lamp_shaders import lamp_light, shaded_lamps
from .lamps import power
from .lamps import sample as sample_lamp
from .suns import without_suns
from .tree import LampTree, lamp_tree
from .world import WorldMap, no_world, sample_world, world_map, world_pdf, world_radiance

_SCATTERED = "IS_DIFFUSE_RAY", "IS_GLOSSY_RAY", "IS_TRANSMISSION_RAY"
PROBES = 4096  # points that estimate the mean of a varying emission


class Lights(NamedTuple):
    """Emitter i is a triangle if i < T, then a lamp if i < T + K, then the world."""

    pick: Inverse
    probability: np.ndarray  # (n,) float32, probability of picking each emitter
    triangle: np.ndarray  # (T,) int32, index in the scene
    faces: np.ndarray  # (T, 4, 3) float32, see `triangle_faces`
    pdf_area: np.ndarray  # (S,) float32, density per area of picking a point on a surface with shader s; 0 if s does not emit
    constant: np.ndarray  # (S,) bool, whether shader s emits the same everywhere and in all directions
    radiance: np.ndarray  # (S, 3) float32, emission of shader s, RGB; read only where it is constant
    lamps: np.ndarray  # (K, COLUMNS) float32
    tree: LampTree  # of the lamps that rays can hit
    world: WorldMap
    world_probability: np.float32  # probability of picking the world; 0 if it is uniform, because scattered rays sample that better


def lights(scene: SceneData, shading: Shading, surface) -> Lights:
    """The scene's lights, for kernels. InputError names a light of infinite power: it has no probability."""
    low, high = scene.bounds
    radius = float(np.linalg.norm(high - low)) / 2
    triangle, area = _emitting(scene)
    constant = np.array([_is_constant(shading, s) for s in range(len(scene.shaders))], bool)
    radiance = _mean_radiance(scene, shading, surface, triangle, area, constant)
    weight = radiance.astype(np.float64) @ LUMINANCE
    triangle, area = _lit(triangle, area, weight[scene.material[triangle]])
    lamps, emitted = shaded_lamps(scene, shading, constant)
    powers = [power(lamp, e, radius) for lamp, e in zip(scene.lamps, emitted, strict=True)]
    local = np.concatenate([2 * np.pi * area * weight[scene.material[triangle]], powers])
    distant = np.zeros(len(local) + 1)
    for k, lamp in enumerate(scene.lamps):
        if lamp.kind == "sun":
            distant[len(triangle) + k], local[len(triangle) + k] = local[len(triangle) + k], 0
    local = np.append(local, 0)
    world, light = _world(scene, shading)
    distant[-1] = light * np.pi * radius**2
    if (endless := np.flatnonzero(np.isinf(local + distant))).size:
        raise InputError(f"{_named(scene, triangle, int(endless[0]))} sends out more light than can be counted")
    share = _halves(local, distant)
    pdf_area = np.zeros(len(scene.shaders), np.float32)
    pdf_area[scene.material[triangle]] = share[: len(triangle)] / np.maximum(area, 1e-30)
    return Lights(
        pick=inverse_table(share if share.any() else np.ones(len(share))),
        probability=share.astype(np.float32),
        triangle=triangle,
        faces=triangle_faces(scene, triangle),
        pdf_area=pdf_area,
        constant=constant,
        radiance=radiance,
        lamps=lamps,
        tree=lamp_tree(lamps),
        world=world,
        world_probability=F(share[-1]),
    )


def _halves(local: np.ndarray, distant: np.ndarray) -> np.ndarray:
    """Probabilities, (n,). Near lights and distant lights (suns, world) have half each, because their powers are not comparable."""
    groups = [group / group.sum() for group in (local, distant) if group.sum() > 0]
    return np.sum(groups, axis=0) / len(groups) if groups else np.zeros(len(local))


def _named(scene: SceneData, triangle: np.ndarray, emitter: int) -> str:
    if emitter < len(triangle):
        return f"shader {scene.shaders[scene.material[triangle[emitter]]].name!r}"
    lamp = emitter - len(triangle)
    return f"lamp {scene.lamps[lamp].name!r}" if lamp < len(scene.lamps) else f"the world's shader {scene.world.name!r}"


def _emitting(scene: SceneData) -> tuple[np.ndarray, np.ndarray]:
    """The triangles that light sampling may pick, (T,) int32, and their areas, (T,) m^2."""
    shines = np.array([any(map(emits, shader.closures)) and not _chooses_rays(shader) for shader in scene.shaders], bool)
    triangle = np.flatnonzero(shines[scene.material]).astype(np.int32)
    corners = scene.vertices[scene.triangles[triangle]]
    edges = (corners[:, 1:] - corners[:, :1]).astype(np.float64)
    return triangle, 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)


def _chooses_rays(shader: Shader) -> bool:
    """Whether emission depends on the kind of the scattered ray. Light sampling has no scattered ray, so it leaves this light out."""
    return any(step.op == "light_path" and step.mode in _SCATTERED for step in shader.code)


def _lit(triangle: np.ndarray, area: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The triangles of positive weight, and their areas."""
    lit = weight > 0
    return triangle[lit], area[lit]


def _is_constant(shading: Shading, shader: int) -> bool:
    """Whether a shader emits the same everywhere and in all directions."""
    first, end = shading.shaders[shader, 2:]
    return all(_emits_evenly(shading, row) for row in shading.closures[first:end])


def _emits_evenly(shading: Shading, row: np.ndarray) -> bool:
    """Whether all operands of a closure's emission are constants (>= 0), and no coat or sheen lies above it."""
    kind = KINDS[row[0]]
    inputs = dict(zip(CLOSURES[kind], row[2:], strict=False))
    if kind == "emission":
        return min(row[1], inputs["color"], inputs["strength"]) >= 0
    if kind != "principled":
        return True
    operands = [row[1], *(inputs[name] for name in ("emission_color", "emission_strength", "alpha", "coat_weight", "sheen_weight"))]
    if inputs["emission_strength"] >= 0 and not shading.constants[inputs["emission_strength"]].any():
        return True
    return min(operands) >= 0 and not shading.constants[operands[4:]].any()


def _mean_radiance(scene, shading, surface, triangle, area, constant) -> np.ndarray:
    """(S, 3) float32: emission of each shader, RGB. An emission that varies is averaged over the shader's triangles."""
    registers = np.zeros((REGISTERS, 3), np.float32)
    radiance = np.zeros((len(scene.shaders), 3), np.float32)
    for shader in np.unique(scene.material[triangle]):
        own = np.flatnonzero(scene.material[triangle] == shader)
        cdf = np.cumsum(area[own])
        probes = 1 if constant[shader] else PROBES
        chosen = own[np.searchsorted(cdf, (np.arange(probes) + 0.5) / probes * cdf[-1]).clip(max=len(own) - 1)]
        radiance[shader] = probe(shading, surface, registers, triangle[chosen], triangle_faces(scene, triangle[chosen]))
    return radiance


@kernel
def probe(shading, surface, registers, triangles, faces):
    """Mean emission along the normal, RGB, over one random point on each of `triangles`, (n,). faces: see `triangle_faces`."""
    shading, surface = ref(shading), ref(surface)
    r, g, b = F(0), F(0), F(0)
    for i in range(triangles.shape[0]):
        u, v = uniform_triangle(*uniform2(stream(0, i, 0, False), 0))
        x, n = on_face(faces, i, u, v)
        light = triangle_radiance(shading, surface, registers, np.int64(triangles[i]), x, n, n, u, v, F(1), np.int64(0), np.int64(0))
        r, g, b = r + light[0], g + light[1], b + light[2]
    return scale((r, g, b), F(1) / F(triangles.shape[0]))


def _world(scene: SceneData, shading: Shading) -> tuple[WorldMap, float]:
    """The map of the world, and the integral of its luminance. An empty map and 0 if the world is uniform or dark."""
    if any(map(emits, scene.world.closures)) and not _is_constant(shading, len(scene.shaders)):
        return world_map(*without_suns(scene.world, shading))
    return no_world(), 0.0


def triangle_faces(scene: SceneData, triangles: np.ndarray) -> np.ndarray:
    """(T, 4, 3) float32 for corners a, b, c: a from the scene's origin, b - a, c - a, and the unit normal."""
    a, b, c = scene.vertices[scene.triangles[triangles].T] - scene.origin
    e, f = b - a, c - a
    n = np.cross(e, f)
    return np.stack([a, e, f, n / np.linalg.norm(n, axis=1, keepdims=True)], axis=1)


@part
def on_face(faces, i, u, v):
    """Point and unit normal of a triangle at barycentrics u, v."""
    p = faces[i]
    x = add(vector(p, 0), add(scale(vector(p, 1), u), scale(vector(p, 2), v)))
    return x, vector(p, 3)


@part
def triangle_radiance(shading, surface, registers, triangle, x, face_normal, wo, u, v, distance, ray, depth):
    """Radiance that a triangle emits from x towards wo, linear RGB.

    x: at barycentrics u, v; face_normal: unit, by winding; distance, ray, depth: see `Point`.
    """
    behind = dot(face_normal, wo) < F(0)
    shader = np.int64(surface.material[triangle])
    n = shading_normal(surface, triangle, u, v, face_normal)
    if behind:
        n, face_normal = scale(n, F(-1)), scale(face_normal, F(-1))
    object_ = surface.object[triangle]
    point = ref(make_point(x, n, face_normal, wo, triangle, object_, u, v, behind, ray, distance, depth))
    run(shading, shader, point, registers)
    return emission(shading, shader, point, registers)


@part
def sample_light(lights, shading, surface, registers, x, depth, choice, u, v):
    """Pick a light by `choice`, float64, then a direction from x to the light by u and v; all three are uniform in [0, 1).

    Returns (wi, reach, radiance, pdf, emitter):
        reach: length of the shadow ray; the ray ends before the light by a bound on rounding
        radiance: RGB, from the light towards x
        pdf: density per solid angle times P(emitter); 0 if no ray can hit the light. Then `radiance` is the irradiance on a surface
            that faces the light, divided by P(emitter).
    """
    emitter, rest = draw(lights.pick, choice)
    chance = lights.probability[emitter]
    triangles, lamps = lights.triangle.shape[0], lights.lamps.shape[0]
    if emitter < triangles:
        a, b = uniform_triangle(u, v)
        y, n = on_face(lights.faces, emitter, a, b)
        to_light = subtract(y, x)
        squared = max(dot(to_light, to_light), F(1e-20))
        distance = np.sqrt(squared)
        wi = scale(to_light, F(1) / distance)
        cosine = abs(dot(n, wi))
        triangle = np.int64(lights.triangle[emitter])
        shader = surface.material[triangle]
        if cosine <= F(1e-6):
            return wi, distance, (F(0), F(0), F(0)), F(1), emitter
        if lights.constant[shader]:
            light = lights.radiance[shader, 0], lights.radiance[shader, 1], lights.radiance[shader, 2]
        else:
            wo = scale(wi, F(-1))
            light = triangle_radiance(shading, surface, registers, triangle, y, n, wo, a, b, distance, np.int64(0), depth)
        reach = max(distance - (surface.error[triangle] + F(2**-21) * distance) / cosine, F(0))
        return wi, reach, light, lights.pdf_area[shader] * squared / cosine, emitter
    if emitter < triangles + lamps:
        wi, distance, light, pdf = sample_lamp(lights.lamps, emitter - triangles, x, u, v)
        light = lamp_light(lights.lamps, shading, registers, emitter - triangles, x, wi, distance, light, depth)
        if pdf == F(0):
            light = scale(light, F(1) / chance)
        return wi, distance * F(1 - 2**-18), light, pdf * chance, emitter
    wi = sample_world(lights.world, F(rest), u, v)
    light = world_radiance(shading, registers, wi, np.int64(0), depth)
    return wi, F(np.inf), light, world_pdf(lights.world, wi) * chance, emitter
