"""Surfaces of constant materials. Python functions call the tracer's kernels on them, with arrays of directions."""

from dataclasses import dataclass

import numpy as np

from blender_rl_guiding.bsdf import surface
from blender_rl_guiding.bsdf.lobe import DIFFUSE_REFLECTION, ROUGH_REFLECTION
from blender_rl_guiding.kernels import kernel
from blender_rl_guiding.kernels.pointers import ref
from blender_rl_guiding.kernels.sampling import F, store, vector
from blender_rl_guiding.scene.description import CLOSURES
from blender_rl_guiding.shading.operands import KINDS, NONE, Point, Shading
from blender_rl_guiding.shading.program import closure_inputs

Closure = tuple[str, dict]  # (kind, inputs that differ from the defaults, with "weight" as one of them)
DIFFUSE, ROUGH = np.int64(DIFFUSE_REFLECTION), np.int64(ROUGH_REFLECTION)  # reach of guides


def shading_of(*closures: Closure) -> Shading:
    """A shader of closures with constant inputs."""
    constants, rows = [], np.zeros((len(closures), 32), np.int32)
    for row, (kind, inputs) in zip(rows, closures, strict=True):
        values = [inputs.get("weight", 1.0), *({**CLOSURES[kind], **inputs}[name] for name in CLOSURES[kind])]
        row[0] = KINDS.index(kind)
        for column, value in enumerate(values, 1):
            row[column] = NONE if value is None else len(constants)
            if value is not None:
                constants.append(np.broadcast_to(np.asarray(value, np.float32), 3))
    none = np.zeros((0, 3, 3), np.float32)
    shaders = np.array([[0, 0, 0, len(rows)]], np.int32)
    texels = np.zeros((0, 4), np.uint8), np.zeros((0, 4), np.float32)
    textures = np.zeros((0, 4), np.int64)
    code, tables = np.zeros((0, 12), np.int32), np.zeros((0, 256, 4), np.float32)
    attributes = none, np.zeros((0, 0), np.int64), none
    numbers = np.array(constants, np.float32).reshape(-1, 3)
    made = Shading(
        shaders,
        code,
        rows,
        *closure_inputs(rows, numbers).values(),
        numbers,
        tables,
        textures,
        *texels,
        *attributes,
        np.zeros((0, 3, 4), np.float32),
        np.zeros(3, np.float32),
    )
    for array in made:
        array.setflags(write=array is made.inputs)  # like the tracer's
    return made


def vector_of(v) -> tuple:
    """A vector as kernels take it."""
    return tuple(F(x) for x in v)


def point_at(wo, n=(0, 0, 1), ng=(0, 0, 1), backfacing: bool = False) -> Point:
    """Where a ray from wo meets a surface with these normals."""
    where = vector_of((0, 0, 0)), *(vector_of(v) for v in (n, ng, wo)), np.int32(0), np.int32(0), F(0), F(0)
    return Point(*where, np.int32(backfacing), np.int32(1), F(1), np.int32(0))


@kernel
def _scatter(shading, point, registers, lobes):
    return surface.scatter(ref(shading), 0, ref(point), registers, lobes)  # references, as in the tracer: compiled only once


@kernel
def _evaluate(lobes, count, ng, wo, wi, reach, f, pdf):
    for i in range(len(wi)):
        value, pdf[i, 0], pdf[i, 1] = surface.evaluate(lobes, count, ng, wo, vector(wi, i), reach)
        store(f, i, value)


@kernel
def _sample(lobes, count, ng, wo, u, wi, label, throughput):
    for i in range(len(u)):
        k, last = surface.pick(lobes, count, u[i, 0])
        direction, label[i] = surface.sample(lobes, k, ng, wo, u[i, 1], u[i, 2], last)
        store(wi, i, direction)
        if label[i] & surface.SINGULAR:
            store(throughput, i, surface.singular(lobes, k, ng, wo, direction, label[i]))


@kernel
def _pick(lobes, count, u, picked, rest):
    for i in range(len(u)):
        picked[i], rest[i] = surface.pick(lobes, count, u[i])


@kernel
def _summary(lobes, count, reach, chances):
    for k in range(count):
        chances[k] = surface.chance(lobes, k)
    return surface.albedo(lobes, count), surface.chance_within(lobes, count, reach)


@dataclass(frozen=True)
class Surface:
    """The lobes of closures, for one direction wo."""

    point: Point
    lobes: np.ndarray
    count: int
    emission: np.ndarray
    transparency: np.ndarray

    def evaluate(self, wi: np.ndarray, reach: np.int64 = DIFFUSE) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(f |cos| (n, 3), density (n,), density of the lobes within reach (n,)) for directions wi (n, 3)."""
        f, pdf = np.empty((len(wi), 3), np.float32), np.empty((len(wi), 2), np.float32)
        _evaluate(self.lobes, self.count, self.point.ng, self.point.wo, np.ascontiguousarray(wi, np.float32), reach, f, pdf)
        return f, pdf[:, 0], pdf[:, 1]

    def sample(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(wi (n, 3), labels (n,), throughput of singular lobes (n, 3)), for uniform numbers u (n, 3)."""
        wi, label, throughput = np.empty((len(u), 3), np.float32), np.empty(len(u), np.int32), np.zeros((len(u), 3), np.float32)
        _sample(self.lobes, self.count, self.point.ng, self.point.wo, np.ascontiguousarray(u, np.float32), wi, label, throughput)
        return wi, label, throughput

    def pick(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(lobe that u picks, u rescaled to be uniform again), for each u (n,)."""
        picked, rest = np.empty(len(u), np.int64), np.empty(len(u), np.float32)
        _pick(self.lobes, self.count, np.ascontiguousarray(u, np.float32), picked, rest)
        return picked, rest

    def summary(self, reach: np.int64 = DIFFUSE) -> tuple[np.ndarray, float, np.ndarray]:
        """(estimated albedo, RGB; probability of picking a lobe within reach; probability of each lobe)."""
        chances = np.empty(self.count, np.float32)
        albedo, within = _summary(self.lobes, self.count, reach, chances)
        return np.array(albedo), float(within), chances


def surface_of(*closures: Closure, wo, n=(0, 0, 1), ng=(0, 0, 1), backfacing: bool = False) -> Surface:
    """The lobes that `scatter` makes of closures."""
    point, lobes = point_at(wo, n, ng, backfacing), np.zeros((surface.LOBES, surface.COLUMNS), np.float32)
    count, emission, transparency = _scatter(shading_of(*closures), point, np.zeros((256, 3), np.float32), lobes)
    return Surface(point, lobes, count, np.array(emission), np.array(transparency))


def direction(degrees: float, turn: float = 0.0) -> np.ndarray:
    """The unit vector at `degrees` from +z, turned by `turn` degrees from +x around z."""
    theta, phi = np.radians([degrees, turn])
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
