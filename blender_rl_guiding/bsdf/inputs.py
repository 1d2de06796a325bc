"""How the inputs of a closure are read: gathered into registers first, then by name, as rows of these.

Passing all shaders to every function of a lobe would cost each call a hundred arguments, and compilation a minute.
"""

from collections import namedtuple

from ..kernels import part
from ..sampling import F, vector
from ..scene.description import CLOSURES
from ..shading.operands import CODE_REGISTERS, KINDS, NONE, REGISTERS
from .lobe import normalized

_LENGTHS = tuple(2 + len(inputs) for inputs in CLOSURES.values())  # columns of each kind of closure
assert max(_LENGTHS) <= REGISTERS - CODE_REGISTERS

WEIGHT = CODE_REGISTERS + 1  # the register of every closure's weight


def columns(kind: str):
    """The register of each input of a kind of closure, as a named tuple, so that kernels read `GLASS.ior`."""
    return namedtuple(kind, CLOSURES[kind])(*(WEIGHT + 1 + i for i in range(len(CLOSURES[kind]))))


def kind(name: str) -> int:
    """The number of a kind of closure."""
    return KINDS.index(name)


@part
def gather(shading, registers, row):
    """Copy the weight and the inputs of a closure to their registers, zero where there is none; returns the closure's kind."""
    # Reads operands as shading.operands.value does. To hand `shading` on for each would take longer than all that is done here.
    closures, constants = shading.closures, shading.constants
    which = closures[row, 0]
    for column in range(1, _LENGTHS[which]):
        operand, register = closures[row, column], WEIGHT - 1 + column
        for i in range(3):
            if operand >= 0:
                registers[register, i] = constants[operand, i]
            else:
                registers[register, i] = F(0) if operand == NONE else registers[~operand, i]
    return which


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
