"""Object attributes: outputs of the Object Info node, and the object's axes."""

from array import array
from collections.abc import Iterable, Sequence

import bpy
import numpy as np

from blender_rl_guiding.errors import InputError

from .custom_attributes import CustomAttributes

_AXES = ("x_axis", "y_axis", "z_axis")
_WORD = 2**32

ObjectKey = str | tuple[str, str, str]  # see `Resources`


class ObjectInfo:
    """Collects the object attributes of a scene, object by object."""

    def __init__(self) -> None:
        self._count = 0
        self._values: dict[ObjectKey, array] = {}  # three numbers for each object, up to the last object with the attribute

    def add(self, names: Iterable[ObjectKey], instance: bpy.types.DepsgraphObjectInstance, custom: CustomAttributes) -> None:
        """Add an object after its shaders have been read. If a number is not finite, InputError; the object is then not added."""
        found = [(name, object_attribute(name, instance, custom)) for name in names]
        for name, numbers in found:
            values = self._values.setdefault(name, array("f"))
            values.extend([0.0] * (3 * self._count - len(values)))
            values.extend(numbers)
        self._count += 1

    def table(self, names: Sequence[ObjectKey]) -> np.ndarray:
        """(B, O, 3) float32; 0 if an object lacks an attribute."""
        rows = np.zeros((len(names), self._count, 3), np.float32)
        for row, name in zip(rows, names, strict=True):
            values = np.array(self._values.get(name, ()), np.float32).reshape(-1, 3)
            row[: len(values)] = values
        return rows


def object_attribute(name: ObjectKey, instance: bpy.types.DepsgraphObjectInstance, custom: CustomAttributes) -> tuple[float, float, float]:
    """One of `Resources.object_attributes`: a triple, or a number thrice. InputError if a number is not finite."""
    x, y, z = _custom(*name, instance, custom) if isinstance(name, tuple) else own_attribute(name, instance)
    if not np.isfinite((x, y, z)).all():
        raise InputError(f"its {name if isinstance(name, str) else name[1]} is not finite: ({x:g}, {y:g}, {z:g})")
    return float(x), float(y), float(z)


def _custom(kind: str, name: str, part: str, instance: bpy.types.DepsgraphObjectInstance, custom: CustomAttributes) -> tuple[float, ...]:
    color = custom.find(kind, name, instance)
    return (color[3],) * 3 if part == "Alpha" else color[:3]


def own_attribute(name: str, instance: bpy.types.DepsgraphObjectInstance) -> tuple[float, float, float]:
    """An output of the Object Info node, or an axis."""
    thing = instance.object
    if name in _AXES:
        matrix = np.array(instance.matrix_world, np.float64)[:3, :3]
        x, y, z = np.linalg.pinv(matrix)[_AXES.index(name)]  # a column of the inverse transpose
    elif name == "color":
        x, y, z = thing.color[:3]
    elif name == "location":
        x, y, z = instance.matrix_world.translation
    else:
        x = y = z = {"alpha": thing.color[3], "object_index": thing.pass_index, "random": random_number(instance)}[name]
    return x, y, z


def random_number(instance: bpy.types.DepsgraphObjectInstance) -> float:
    """A number in 0..1, as in Cycles: a hash of the object's name; for an instance, Blender's own number."""
    number = instance.random_id % _WORD if instance.is_instance else _hash(_hash_string(instance.object.name))
    return number / (_WORD - 1)


def _hash_string(text: str) -> int:
    number = 0
    for byte in text.encode():
        number = (number * 37 + byte) % _WORD
    return number


def _hash(number: int) -> int:
    """The final mix of Bob Jenkins' lookup3 (public domain, http://burtleburtle.net/bob/c/lookup3.c) of the pair (number, 0)."""
    start = 0xDEADBEEF + (2 << 2) + 13
    words = [(start + number) % _WORD, start, start]
    for step, turn in enumerate((14, 11, 25, 16, 4, 14, 24)):
        target, other = (2 + step) % 3, (1 + step) % 3
        words[target] = ((words[target] ^ words[other]) - _rotated(words[other], turn)) % _WORD
    return words[2]


def _rotated(word: int, by: int) -> int:
    return (word << by | word >> 32 - by) % _WORD
