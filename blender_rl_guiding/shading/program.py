"""Compiles the shaders of a scene to arrays for the kernels.

Steps that do not depend on the point are computed here, once, by the kernels that compute the other steps at every point.
"""

import numpy as np

from ..errors import InputError
from ..kernels import kernel
from ..kernels.pointers import ref
from ..kernels.sampling import F
from ..scene.data import SceneData, Texture, first_triangles
from ..scene.description import CLOSURES, Closure, Instruction, Node, Shader, Value
from ..scene.ops import MAX_INPUTS, MAX_OPTIONS, OPS, Alpha, Extension, Interpolation, Projection, fault
from .evaluate import Code, run
from .operands import CODE_REGISTERS, KINDS, NONE, Point, Shading
from .rewriting import (
    MOST_STEPS_OF_ALL,
    allocate,
    changed,
    constant_steps,
    with_bumps,
    with_constants,
    with_normal,
    with_simpler_closures,
    without_idle_steps,
)
from .textures import CODES, FLOATS, SRGB_CODES

STEP_COLUMNS, CLOSURE_COLUMNS = 3 + MAX_INPUTS + MAX_OPTIONS, 32
ZERO = (F(0), F(0), F(0))
NOWHERE = Point(ZERO, ZERO, ZERO, ZERO, np.int32(-1), np.int32(-1), F(0), F(0), np.int32(0), np.int32(0), F(0), np.int32(0))


def compile_shaders(scene: SceneData) -> Shading:
    """All shaders as arrays; the world's shader is last. InputError names the shader and the step that cannot run."""
    shaders = (*scene.shaders, scene.world)
    for shader in shaders:
        check(shader, scene)
    return _compiled(shaders, _assets(scene, any(step.op == "bump" for shader in shaders for step in shader.code)))


def compile_alone(shader: Shader, shading: Shading) -> Shading:
    """A Shading with this shader only, and the textures, tables and attributes of `shading`."""
    return _compiled((shader,), shading)


def _compiled(shaders: tuple[Shader, ...], assets: Shading) -> Shading:
    program, steps = Program(), 0
    for shader in shaders:
        complete = with_normal(shader)
        simple = with_simpler_closures(with_constants(complete, _constants(complete, assets)))
        short = without_idle_steps(simple)
        ready = with_bumps(short, len(assets.attribute_rows) - 1)
        steps += len(ready.code)
        if steps > MOST_STEPS_OF_ALL:
            raise InputError(f"the shaders up to {shader.name!r} have more than {MOST_STEPS_OF_ALL} steps, their bumps' included")
        registers, count = allocate(ready)
        if count > CODE_REGISTERS:
            raise InputError(f"shader {shader.name!r} keeps {count} values at once, but there are {CODE_REGISTERS} registers")
        program.add(ready, registers)
    return program.into(assets)


def check(shader: Shader, scene: SceneData) -> None:
    """InputError if a step of the shader's code is not one of `scene.ops`, or refers to something that the scene does not have."""
    limits = _limits(scene)
    for k, step in enumerate(shader.code):
        problem = fault(step.op, step.mode, len(step.inputs), len(step.options)) or _bad_option(step, limits)
        if problem:
            raise InputError(f"shader {shader.name!r}, step {k}, {step.op}: {problem}")


def _bad_option(step: Instruction, limits: dict[str, int]) -> str:
    """The first option of a step that is outside 0..limit - 1, in a few words; empty if there is none."""
    for name, option in zip(OPS[step.op].options, step.options, strict=True):
        limit = limits.get(name, 2)  # an option without a limit is a flag
        if not 0 <= option < limit:
            return f"{name} is {option}, but there are {limit}"
    return ""


def _limits(scene: SceneData) -> dict[str, int]:
    """The limit of each option, by name: 0 <= option < limit."""
    attributes, object_attributes = len(scene.attribute_rows), len(scene.object_attributes)
    return {
        **dict.fromkeys(("attribute", "tangent", "sign", "normal"), attributes),
        **dict.fromkeys(("object_attribute", "x_axis", "y_axis", "z_axis"), object_attributes),
        "texture": len(scene.textures),
        "table": len(scene.tables),
        "extension": len(Extension),
        "interpolation": len(Interpolation),
        "projection": len(Projection),
        "alpha": len(Alpha),
        "index": 3,
        "dimensions": 4,
    }


def _constants(shader: Shader, assets: Shading) -> dict[int, Value]:
    """Step number -> value, for the steps with the same value at every point."""
    steps = constant_steps(shader)
    places = {k: Node(place) for place, k in enumerate(steps)}
    part = changed(Shader(shader.name, tuple(shader.code[k] for k in steps)), places.__getitem__)
    program, registers = Program(), np.zeros((len(steps), 3), np.float32)
    program.add(part, list(range(len(steps))))
    _run_first(program.into(assets), NOWHERE, registers)
    return {k: (r, g, b) for k, (r, g, b) in zip(steps, registers.tolist(), strict=True)}


@kernel
def _run_first(shading, point, registers):
    """Run the first shader. Arguments are references, as in the tracer, so Numba compiles `run` only once."""
    run(ref(shading), np.int64(0), ref(point), registers)


class Program:
    """Collects shaders as rows of numbers."""

    def __init__(self) -> None:
        self._constants: dict[tuple[float, ...], int] = {(0.0, 0.0, 0.0): 0}  # row 0: for operand columns without an input
        self._code: list[list[int]] = []
        self._closures: list[list[int]] = []
        self._shaders: list[tuple[int, int, int, int]] = []

    def add(self, shader: Shader, registers: list[int]) -> None:
        """Append a shader. Step k writes to register registers[k]."""
        code, closures = len(self._code), len(self._closures)
        self._code += [self._step(step, register, registers) for step, register in zip(shader.code, registers, strict=True)]
        self._closures += [self._closure(closure, registers) for closure in shader.closures]
        self._shaders.append((code, len(self._code), closures, len(self._closures)))

    def into(self, assets: Shading) -> Shading:
        """`assets` with the fields of this program."""
        closures = np.array(self._closures, np.int32).reshape(-1, CLOSURE_COLUMNS)
        constants = np.array(list(self._constants), np.float32)
        program = assets._replace(
            shaders=np.array(self._shaders, np.int32),
            code=np.array(self._code, np.int32).reshape(-1, STEP_COLUMNS),
            closures=closures,
            constants=constants,
            **closure_inputs(closures, constants),
        )
        for array in program:  # Numba compiles again if an array is writeable in one call, and not in another
            array.setflags(write=array is program.inputs)  # `gather` returns `inputs` or registers, and registers are writeable
        return program

    def _step(self, step: Instruction, register: int, registers: list[int]) -> list[int]:
        modes = OPS[step.op].modes if step.op in OPS else None
        operands = [self._operand(value, registers) for value in step.inputs]
        head = [Code[step.op.upper()], modes[step.mode] if modes else 0, register]
        return head + _padded(operands, MAX_INPUTS) + _padded(list(step.options), MAX_OPTIONS)

    def _closure(self, closure: Closure, registers: list[int]) -> list[int]:
        values = (CLOSURES[closure.kind] | closure.inputs).values()
        operands = [NONE if value is None else self._operand(value, registers) for value in (closure.weight, *values)]
        return _padded([KINDS.index(closure.kind), *operands], CLOSURE_COLUMNS)

    def _operand(self, value: Value, registers: list[int]) -> int:
        if isinstance(value, Node):
            return ~registers[value.index]
        triple = value if isinstance(value, tuple) else (value, value, value)
        return self._constants.setdefault(triple, len(self._constants))


def closure_inputs(closures: np.ndarray, constants: np.ndarray) -> dict[str, np.ndarray]:
    """The fields `inputs`, `varying` and `first_varying` of Shading; `bsdf.inputs.gather` reads them."""
    operands = closures[:, 1:]
    row, column = np.nonzero((operands < 0) & (operands != NONE))
    return {
        "inputs": np.where((operands >= 0)[..., None], constants[operands.clip(0)], F(0)),
        "varying": np.stack([column, ~operands[row, column]], axis=1).astype(np.int32),
        "first_varying": np.searchsorted(row, np.arange(len(closures) + 1)).astype(np.int32),
    }


def _padded(numbers: list[int], length: int) -> list[int]:
    return numbers + [0] * (length - len(numbers))


# --- assets ----------------------------------------------------------------------------------------------------------


def _assets(scene: SceneData, bumps: bool) -> Shading:
    """A Shading without code: textures, tables and attributes of the scene. bumps: add the position as the last attribute."""
    objects = len(scene.visibility)
    table = scene.attribute_rows.reshape(len(scene.attribute_rows), objects)
    rows = np.where(table < 0, NONE, table - first_triangles(scene))
    attributes = scene.attributes
    if bumps:
        rows = np.concatenate([rows, np.full((1, objects), len(attributes))])
        attributes = np.concatenate([attributes, scene.vertices[scene.triangles]])
    empty = np.zeros((0, 0), np.int32)
    return Shading(
        shaders=empty,
        code=empty,
        closures=empty,
        inputs=np.zeros((0, 0, 3), np.float32),
        varying=empty,
        first_varying=np.zeros(1, np.int32),
        constants=np.zeros((1, 3), np.float32),
        tables=scene.tables,
        **_texels(scene.textures),
        attributes=attributes,
        attribute_rows=rows.astype(np.int64),
        object_attributes=scene.object_attributes,
        to_world=scene.instance_to_world,
        origin=scene.origin,
    )


def _texels(textures: tuple[Texture, ...]) -> dict[str, np.ndarray]:
    """The fields `textures`, `bytes` and `floats` of Shading, with the texels of one texture after another."""
    table, ends = np.zeros((len(textures), 6), np.int64), {np.dtype(np.uint8): 0, np.dtype(np.float32): 0}
    for row, texture in zip(table, textures, strict=True):
        height, width, _ = texture.texels.shape
        dtype = texture.texels.dtype
        kind = FLOATS if dtype == np.float32 else SRGB_CODES if texture.srgb else CODES
        row[:] = ends[dtype], width, height, kind, texture.tile, texture.rest
        ends[dtype] += width * height
    texels = {dtype: [t.texels.reshape(-1, 4) for t in textures if t.texels.dtype == dtype] for dtype in ends}
    codes, floats = (np.concatenate([np.zeros((0, 4), dtype), *parts]) for dtype, parts in texels.items())
    return {"textures": table, "bytes": codes, "floats": floats}
