"""How the inputs of a closure are read: gathered first, then by name, as rows of an array.

Passing all shaders to every function of a lobe would cost each call a hundred arguments, and compilation a minute.
"""

from collections import namedtuple

from ..kernels import merged, part
from ..kernels.sampling import F, store, vector
from ..scene.description import CLOSURES
from ..shading.operands import CODE_REGISTERS, KINDS, REGISTERS
from .lobe import normalized

WEIGHT = 0  # the row of every closure's weight
assert max(map(len, CLOSURES.values())) < REGISTERS - CODE_REGISTERS


def columns(kind: str):
    """The row of each input of a kind of closure, as a named tuple, so that kernels read `GLASS.ior`."""
    return namedtuple(kind, CLOSURES[kind])(*(WEIGHT + 1 + i for i in range(len(CLOSURES[kind]))))


def kind(name: str) -> int:
    """The number of a kind of closure."""
    return KINDS.index(name)


@merged
def gather(shading, registers, row):
    """The weight and the inputs of a closure, zero where there is none: (31, 3) float32, good until the next closure is gathered."""
    constant, first, end = shading.inputs[row], shading.first_varying[row], shading.first_varying[row + 1]
    inputs = constant
    if first < end:  # of most closures all is constant, and nothing has to be moved
        inputs = registers[CODE_REGISTERS:]
        for k in range(constant.shape[0]):  # all that any closure may have: moving them in one go is quicker than counting
            store(inputs, k, vector(constant, k))
        for v in range(first, end):
            store(inputs, shading.varying[v, 0], vector(registers, shading.varying[v, 1]))
    return inputs


@part
def number(inputs, row):
    """A number."""
    return inputs[row, 0]


@part
def color(inputs, row):
    """A colour; negative channels count as 0."""
    return max(inputs[row, 0], F(0)), max(inputs[row, 1], F(0)), max(inputs[row, 2], F(0))


@part
def factor(inputs, row):
    """A number between 0 and 1."""
    return min(max(inputs[row, 0], F(0)), F(1))


@part
def positive(inputs, row):
    """A number; below 1e-5 it counts as that."""
    return max(inputs[row, 0], F(1e-5))


@part
def normal(inputs, row, fallback):
    """A unit normal; the fallback where there is none."""
    return normalized(vector(inputs, row), fallback)


@part
def tangent(inputs, row):
    """A tangent of any length, zero where there is none."""
    return vector(inputs, row)
