"""How the inputs of a closure are read: gathered into registers first, then by name, as rows of these.

Passing all shaders to every function of a lobe would cost each call a hundred arguments, and compilation a minute.
"""

from collections import namedtuple

from ..kernels import part
from ..sampling import F, store, vector
from ..scene.description import CLOSURES
from ..shading.operands import CODE_REGISTERS, KINDS, REGISTERS
from .lobe import normalized

WEIGHT = CODE_REGISTERS + 1  # the register of every closure's weight
assert max(map(len, CLOSURES.values())) < REGISTERS - WEIGHT


def columns(kind: str):
    """The register of each input of a kind of closure, as a named tuple, so that kernels read `GLASS.ior`."""
    return namedtuple(kind, CLOSURES[kind])(*(WEIGHT + 1 + i for i in range(len(CLOSURES[kind]))))


def kind(name: str) -> int:
    """The number of a kind of closure."""
    return KINDS.index(name)


@part
def gather(shading, registers, row):
    """Copy the weight and the inputs of a closure to their registers, zero where there is none; returns the closure's kind."""
    inputs = shading.inputs[row]
    for k in range(inputs.shape[0]):  # all that any closure may have: moving them in one go is quicker than counting
        store(registers, WEIGHT + k, vector(inputs, k))
    for v in range(shading.first_varying[row], shading.first_varying[row + 1]):
        store(registers, WEIGHT + shading.varying[v, 0], vector(registers, shading.varying[v, 1]))
    return shading.closures[row, 0]


@part
def number(registers, row):
    """A number."""
    return registers[row, 0]


@part
def color(registers, row):
    """A colour; negative channels count as 0."""
    return max(registers[row, 0], F(0)), max(registers[row, 1], F(0)), max(registers[row, 2], F(0))


@part
def factor(registers, row):
    """A number between 0 and 1."""
    return min(max(registers[row, 0], F(0)), F(1))


@part
def positive(registers, row):
    """A number; below 1e-5 it counts as that."""
    return max(registers[row, 0], F(1e-5))


@part
def normal(registers, row, fallback):
    """A unit normal; the fallback where there is none."""
    return normalized(vector(registers, row), fallback)


@part
def tangent(registers, row):
    """A tangent of any length, zero where there is none."""
    return vector(registers, row)
