"""Inputs of a closure: `gather` copies them to the rows of an array; lobes read each row by its name.

Why: all shaders as an argument of each lobe's functions would be a hundred arguments per call, and a minute of compiling.
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
    """The row of each input of a kind of closure, as a named tuple: kernels write `GLASS.ior`."""
    return namedtuple(kind, CLOSURES[kind])(*(WEIGHT + 1 + i for i in range(len(CLOSURES[kind]))))


def kind(name: str) -> int:
    """The number of a kind of closure."""
    return KINDS.index(name)


@merged
def gather(shading, registers, row):
    """The weight and the inputs of a closure, (31, 3) float32; rows without an input are 0. Valid until the next `gather`."""
    constant, first, end = shading.inputs[row], shading.first_varying[row], shading.first_varying[row + 1]
    inputs = constant
    if first < end:  # most closures have only constant inputs: no copy
        inputs = registers[CODE_REGISTERS:]
        for k in range(constant.shape[0]):  # copies all rows, which is faster than counting the used rows
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
    """A number, at least 1e-5."""
    return max(inputs[row, 0], F(1e-5))


@part
def normal(inputs, row, fallback):
    """The unit normal in row `row`; `fallback` if the row is zero."""
    return normalized(vector(inputs, row), fallback)


@part
def tangent(inputs, row):
    """The tangent in row `row`, of any length; zero if there is none."""
    return vector(inputs, row)
