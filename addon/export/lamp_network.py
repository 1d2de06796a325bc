"""Nodes of a lamp: position, direction and coordinates of the emitting point, as measured in Cycles."""

import math

import bpy
import numpy as np

from blender_rl_guiding.scene.description import Value

from .network import Network
from .nodes import READERS
from .object_info import own_attribute
from .resources import Resources


class LampNetwork(Network):
    """The code of one lamp's shader. The lamp's matrix is known at export, so attributes become arithmetic."""

    lamp = True

    def __init__(self, resources: Resources, instance: bpy.types.DepsgraphObjectInstance, depsgraph: bpy.types.Depsgraph) -> None:
        super().__init__(READERS, resources)
        self._instance, self._depsgraph, self.light = instance, depsgraph, instance.object.data
        self._matrix = np.array(instance.matrix_world, np.float64)
        self.distant = self.light.type == "SUN"

    def attribute(self, kind: str, name: str = "") -> Value:
        """Coordinates; for other attributes 0, and an alpha of 1, as in Cycles."""
        if kind == "PARAMETRIC" or (kind == "UV" and not name):
            return _COORDINATES[self.light.type](self)
        if kind == "GENERATED" or kind == "OBJECT":
            return self._in_space_of(name)
        if kind == "OBJECT_NORMAL":
            return self._turned(self._matrix[:3, :3].T, self.add("normal"))
        return 1.0 if kind == "ATTRIBUTE_ALPHA" else 0.0

    def object_attribute(self, name: str) -> Value:
        """An output of the Object Info node."""
        return own_attribute(name, self._instance)

    def light_path(self, mode: str) -> Value:
        """As for surfaces, but 0 for the kind of a ray: Cycles does not tell it to lamps."""
        return 0.0 if mode.startswith("IS_") else super().light_path(mode)

    def _in_space_of(self, name: str) -> Value:
        other = bpy.data.objects.get(name)
        matrix = np.array(other.evaluated_get(self._depsgraph).matrix_world, np.float64) if other else self._matrix
        place = self.add("vector_math", self.add("position"), _triple(matrix[:3, 3]), 0.0, 0.0, mode="SUBTRACT")
        return self._turned(np.linalg.pinv(matrix[:3, :3]), place)

    def to_lamp(self, direction: Value) -> Value:
        """A direction in the space of the lamp, of length 1."""
        return self.add("vector_math", self._turned(np.linalg.pinv(self._matrix[:3, :3]), direction), 0.0, 0.0, 0.0, mode="NORMALIZE")

    def _turned(self, rows: np.ndarray, vector: Value) -> Value:
        """(3, 3) rows times a vector."""
        parts = [self.add("vector_math", vector, _triple(row), 0.0, 0.0, mode="DOT_PRODUCT") for row in rows]
        return self.add("combine", *parts, mode="RGB")

    def math(self, mode: str, a: Value, b: Value = 0.0, c: Value = 0.0) -> Value:
        """One step of arithmetic."""
        return self.add("math", a, b, c, mode=mode, options=(0,))

    def component(self, vector: Value, index: int) -> Value:
        """x, y or z."""
        return self.add("component", vector, options=(index,))

    def uv(self, u: Value, v: Value) -> Value:
        """Coordinates of an image."""
        return self.add("combine", u, v, 0.0, mode="RGB")


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


# --- UV and Parametric -----------------------------------------------------------------------------------------------


def _of_area(network: LampNetwork) -> Value:
    """0 to 1 across the lamp."""
    light = network.light
    height = light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size
    place = network.attribute("OBJECT")
    u, v = (network.math("MULTIPLY_ADD", network.component(place, k), 1 / size, 0.5) for k, size in enumerate((light.size, height)))
    return network.uv(u, v)


def _of_point(network: LampNetwork) -> Value:
    """Longitude around the lamp's z axis and latitude of the normal."""
    x, y, z = (network.component(network.to_lamp(network.add("normal")), k) for k in range(3))
    longitude, polar = network.math("ARCTAN2", x, y), network.math("ARCCOSINE", z)
    u = network.math("MULTIPLY_ADD", longitude, -0.5 / math.pi, 0.5)
    return network.uv(u, network.math("MULTIPLY_ADD", polar, -1 / math.pi, 1.0))


def _of_spot(network: LampNetwork) -> Value:
    """0 to 1 across the cone."""
    x, y, z = (network.component(network.to_lamp(network.add("incoming")), k) for k in range(3))
    scale = network.math("DIVIDE", -0.5 / math.tan(network.light.spot_size / 2), z)
    return network.uv(network.math("MULTIPLY_ADD", x, scale, 0.5), network.math("MULTIPLY_ADD", y, scale, 0.5))


def _of_sun(network: LampNetwork) -> Value:
    """0 to 1 across the disc."""
    if not network.light.angle:
        return 0.5, 0.5, 0.0
    x, y, z = (network.component(network.to_lamp(network.add("incoming")), k) for k in range(3))
    length = network.math("SQRT", network.math("MULTIPLY_ADD", z, -2.0, 2.0))  # of the sum of the direction and the axis
    scale = network.math("DIVIDE", -0.5 / math.sin(network.light.angle / 4), length)
    return network.uv(network.math("MULTIPLY_ADD", x, scale, 0.5), network.math("MULTIPLY_ADD", y, scale, 0.5))


_COORDINATES = {"AREA": _of_area, "POINT": _of_point, "SPOT": _of_spot, "SUN": _of_sun}
