"""Rewrites a shader before it becomes arrays. Each function takes a shader and returns a shader."""

from collections.abc import Callable, Iterable
from dataclasses import replace

from ..errors import InputError
from ..scene.description import CLOSURES, Closure, Instruction, Node, Shader, Value
from ..scene.ops import OPS

NORMAL = Node(0)  # the first step of every shader after `with_normal`
# Most steps of one shader, and of all shaders (some 10 s), bumps included. A bump repeats the steps of its height twice.
MOST_STEPS, MOST_STEPS_OF_ALL = 1 << 16, 1 << 19
Change = Callable[[int], Value]
# Inputs of a Principled BSDF. First: the weights of layers above the diffuse base. Then: the inputs of the base and of the emission, by
# their names in the closures "diffuse" and "emission".
_ABOVE_THE_BASE = "metallic", "transmission", "specular_ior_level", "coat_weight", "sheen_weight"
_BASE = {"color": "base_color", "roughness": "diffuse_roughness", "normal": "normal"}
_LIGHT = {"color": "emission_color", "strength": "emission_strength"}


def with_normal(shader: Shader) -> Shader:
    """The shader with a new first step, the shading normal. This step becomes the normal of each step without a normal."""
    moved = changed(shader, lambda index: Node(index + 1))
    code = (step if len(step.inputs) == len(OPS[step.op].inputs) else replace(step, inputs=(*step.inputs, NORMAL)) for step in moved.code)
    return replace(moved, code=(Instruction("normal"), *code))


def constant_steps(shader: Shader) -> list[int]:
    """The numbers of the steps with the same value at every point."""
    found: set[int] = set()
    for k, step in enumerate(shader.code):
        if OPS[step.op].pure and found.issuperset(_steps(step.inputs)):
            found.add(k)
    return sorted(found)


def with_constants(shader: Shader, values: dict[int, Value]) -> Shader:
    """The shader with values[k] in place of each reference to step k. The steps stay, but nothing reads them."""
    return changed(shader, lambda index: values.get(index, Node(index)))


def without_idle_steps(shader: Shader) -> Shader:
    """The shader without the steps that no closure needs."""
    needed = sorted(_ancestors(shader.code, _read_by_closures(shader), through_bumps=True))
    places = {k: Node(place) for place, k in enumerate(needed)}
    return changed(replace(shader, code=tuple(shader.code[k] for k in needed)), places.__getitem__)


def with_simpler_closures(shader: Shader) -> Shader:
    """The shader in which "diffuse" and "emission" replace each Principled BSDF that has no other lobe."""
    return replace(shader, closures=tuple(simpler for closure in shader.closures for simpler in _simpler(closure)))


def _simpler(closure: Closure) -> tuple[Closure, ...]:
    if closure.kind != "principled":
        return (closure,)
    inputs = CLOSURES["principled"] | closure.inputs
    if not (_number(inputs["alpha"], 0.0) >= 1 and all(_number(inputs[name], 1.0) <= 0 for name in _ABOVE_THE_BASE)):
        return (closure,)
    base, light = _renamed("diffuse", closure, inputs, _BASE), _renamed("emission", closure, inputs, _LIGHT)
    return (base,) if _number(inputs["emission_strength"], 1.0) == 0 else (base, light)


def _renamed(kind: str, closure: Closure, inputs: dict[str, Value | None], names: dict[str, str]) -> Closure:
    return Closure(kind, closure.weight, {new: value for new, old in names.items() if (value := inputs[old]) is not None})


def _number(value: Value | None, otherwise: float) -> float:
    """The number of a constant input; `otherwise` if the input varies."""
    return value[0] if isinstance(value, tuple) else value if isinstance(value, float) else otherwise


def with_bumps(shader: Shader, positions: int) -> Shader:
    """The shader that computes the height of each bump at three points: the point, and the two of `geometry.shifted`.

    positions: number of the attribute with the corners of triangles. A bump inside the height of another bump is not computed at
    shifted points. InputError if there are too many steps.
    """
    code: list[Instruction] = []
    places: dict[int, Value] = {}
    for k, step in enumerate(shader.code):
        moved = _changed_step(step, places.__getitem__)
        height = step.inputs[0] if step.op == "bump" else None
        if isinstance(height, Node):
            below = sorted(_ancestors(shader.code, [height.index], through_bumps=False))
            beside = [_beside([(i, shader.code[i]) for i in below], places, (positions, side), code) for side in (1, 2)]
            code += [Instruction("shift", options=(positions, 0)), Instruction("combine", (moved.inputs[0], *beside), "RGB")]
            moved = replace(moved, inputs=(Node(len(code) - 1), *moved.inputs[1:]))
        places[k] = Node(len(code))
        code.append(moved)
        if len(code) > MOST_STEPS:
            raise InputError(f"shader {shader.name!r} has more than {MOST_STEPS} steps, its bumps' included")
    return replace(shader, code=tuple(code), closures=_changed_closures(shader, places.__getitem__))


def _beside(steps: list[tuple[int, Instruction]], places: dict[int, Value], shift: tuple[int, int], code: list[Instruction]) -> Value:
    """Append copies of `steps` to `code`, which run at the shifted point. Returns the value of the last copy."""
    code.append(Instruction("shift", options=shift))
    copies = dict(places)
    for k, step in steps:
        if step.op != "bump":
            copies[k] = Node(len(code))
            code.append(_changed_step(step, copies.__getitem__))
    return copies[steps[-1][0]]


def allocate(shader: Shader) -> tuple[list[int], int]:
    """(register of each step, number of registers). A register becomes free after the last read of its value."""
    last = {k: len(shader.code) for k in _read_by_closures(shader)}
    for k, step in reversed(list(enumerate(shader.code))):
        for index in _steps(step.inputs):
            last.setdefault(index, k)
    free: list[int] = []
    registers: list[int] = []
    count = 0
    for k, step in enumerate(shader.code):
        free += [registers[index] for index in set(_steps(step.inputs)) if last[index] == k]
        if not free:
            free.append(count)
            count += 1
        registers.append(free.pop())
        if last.get(k, k) == k:  # no step reads the value
            free.append(registers[k])
    return registers, count


# --- parts -----------------------------------------------------------------------------------------------------------


def changed(shader: Shader, change: Change) -> Shader:
    """The shader with change(k) in place of each reference to step k."""
    code = tuple(_changed_step(step, change) for step in shader.code)
    return replace(shader, code=code, closures=_changed_closures(shader, change))


def _changed_step(step: Instruction, change: Change) -> Instruction:
    return replace(step, inputs=tuple(_changed(value, change) for value in step.inputs))


def _changed_closures(shader: Shader, change: Change) -> tuple[Closure, ...]:
    return tuple(
        replace(c, weight=_changed(c.weight, change), inputs={name: _changed(value, change) for name, value in c.inputs.items()})
        for c in shader.closures
    )


def _changed(value: Value, change: Change) -> Value:
    return change(value.index) if isinstance(value, Node) else value


def _steps(values: Iterable[Value]) -> list[int]:
    return [value.index for value in values if isinstance(value, Node)]


def _read_by_closures(shader: Shader) -> list[int]:
    return _steps(value for closure in shader.closures for value in (closure.weight, *closure.inputs.values()))


def _ancestors(code: tuple[Instruction, ...], starts: Iterable[int], through_bumps: bool) -> set[int]:
    """The steps that `starts` depend on, and `starts`. through_bumps: also the steps that a bump depends on."""
    found: set[int] = set()
    todo = list(starts)
    while todo:
        k = todo.pop()
        if k not in found:
            found.add(k)
            todo += _steps(code[k].inputs) if through_bumps or code[k].op != "bump" else []
    return found
