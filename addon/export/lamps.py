"""Lamps: Blender's powers and sizes as the radiometric quantities of `Lamp`. The units were measured against Cycles."""

import math
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np

from blender_rl_guiding.scene.description import Closure, Color, Lamp, Loss, Matrix, Node, Shader, Value

from .lamp_network import LampNetwork
from .materials import has_nodes
from .resources import Resources
from .shaders import closures_at

_MAX_BOUNCES = 1024  # the default limit of a lamp
_WHITE = (1.0, 1.0, 1.0)
_STRAIGHT = 1e-4  # axes with a smaller cosine count as perpendicular; scales with a smaller relative difference count as equal


def read_lamp(
    instance: bpy.types.DepsgraphObjectInstance, visibility: int, resources: Resources, depsgraph: bpy.types.Depsgraph
) -> tuple[Lamp | None, Shader | None, list[Loss]]:
    """A lamp, its shader if the light varies, and its losses. If there is no light, the lamp is None."""
    thing, matrix = instance.object, np.array(instance.matrix_world, np.float64)
    light = thing.data
    unit, shape = _SHAPES[light.type](light, matrix)
    if not unit:
        return None, None, []
    factor, shader, notes = _read_nodes(light, LampNetwork(resources, instance, depsgraph))
    power = [unit * f * c for f, c in zip(factor, _power(light), strict=True)]
    if not any(power):
        return None, None, []
    losses = [Loss(thing.name, where, detail) for where, detail in (*notes, *_losses(thing, matrix))]
    if min(power) < 0:
        losses.append(Loss(thing.name, "", "negative light: zero stands in"))
    if max(power) <= 0 or _of_cycles(light, "is_portal", False):
        return None, None, losses
    red, green, blue = (max(p, 0.0) for p in power)
    mis = _of_cycles(light, "use_multiple_importance_sampling", True)
    frame = _frame(matrix)
    lamp = Lamp(thing.name, light.type.lower(), frame, (red, green, blue), visibility=visibility, shadow=light.use_shadow, mis=mis, **shape)
    return lamp, shader, losses


def _of_cycles(light: bpy.types.Light, name: str, default: Any) -> Any:
    """A setting that exists only in a Blender with Cycles."""
    return getattr(light.cycles, name) if hasattr(light, "cycles") else default


# --- power -----------------------------------------------------------------------------------------------------------


def _power(light: bpy.types.Light) -> Color:
    """Watts, for suns W/m^2, of each colour."""
    tint = light.temperature_color if light.use_temperature else (1.0, 1.0, 1.0)
    scale = light.energy * 2.0**light.exposure
    red, green, blue = (scale * c * t for c, t in zip(light.color, tint, strict=True))
    return red, green, blue


def _read_nodes(light: bpy.types.Light, network: LampNetwork) -> tuple[Color, Shader | None, list[tuple[str, str]]]:
    """The factors of the lamp's nodes on its power: a colour, and a shader if they vary. Also notes, as in `Network`."""
    if not has_nodes(light):
        return _WHITE, None, []
    output = light.node_tree.get_output_node("CYCLES")
    closures = tuple(closures_at(network, output.inputs["Surface"])) if output else ()
    notes = [(f"lamp '{light.name}', {where}", detail) for where, detail in network.notes]
    if any(isinstance(value, Node) or closure.kind != "emission" for closure in closures for value in _values(closure)):
        return _WHITE, Shader(light.name, network.code, closures), notes
    red, green, blue = sum(map(_product, closures), np.zeros(3)).tolist()
    return (red, green, blue), None, notes


def _product(closure: Closure) -> np.ndarray:
    return np.prod([np.broadcast_to(value, 3) for value in _values(closure) if not isinstance(value, Node)], axis=0)


def _values(closure: Closure) -> tuple[Value, ...]:
    return closure.weight, *closure.inputs.values()


# --- shape -----------------------------------------------------------------------------------------------------------
# Each of these returns `Lamp.emission` for a power of 1, and the fields of `Lamp` for its kind.


def _point(light: bpy.types.Light, matrix: np.ndarray) -> tuple[float, dict[str, Any]]:
    radius = light.shadow_soft_size
    unit = 1 / (4 * math.pi)
    if not light.normalize:
        unit = radius**2 if radius else 1 / math.pi
    return unit, {"radius": radius, "soft": light.use_soft_falloff}


def _spot(light: bpy.types.Light, matrix: np.ndarray) -> tuple[float, dict[str, Any]]:
    unit, shape = _point(light, matrix)
    return unit, shape | {"cone": light.spot_size / 2, "blend": light.spot_blend}


def _sun(light: bpy.types.Light, matrix: np.ndarray) -> tuple[float, dict[str, Any]]:
    radius = light.angle / 2
    return 1.0 if light.normalize or not radius else math.pi * math.sin(radius) ** 2, {"radius": radius}


def _area(light: bpy.types.Light, matrix: np.ndarray) -> tuple[float, dict[str, Any]]:
    """Without an area it emits nothing, as in Cycles."""
    ellipse = light.shape in ("DISK", "ELLIPSE")
    height = light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size
    width, height = (float(size * np.linalg.norm(axis)) for size, axis in zip((light.size, height), matrix[:3, :2].T, strict=True))
    area = width * height * (math.pi / 4 if ellipse else 1.0)
    unit = 1 / (math.pi * (area if light.normalize else 1.0)) if area else 0.0
    return unit, {"width": width, "height": height, "ellipse": ellipse, "spread": light.spread}


_SHAPES = {"POINT": _point, "SPOT": _spot, "SUN": _sun, "AREA": _area}


def _frame(matrix: np.ndarray) -> Matrix:
    """A lamp's position and right-handed unit axes. z keeps its direction; x and y are made perpendicular to z."""
    y, z = matrix[:3, 1], matrix[:3, 2]
    z = _unit(z, np.array((0.0, 0.0, 1.0)))
    aside = np.eye(3)[np.abs(z).argmin()]
    y = _unit(y - (y @ z) * z, _unit(np.cross(z, np.cross(aside, z)), aside))
    frame = np.eye(4)
    frame[:3] = np.stack([np.cross(y, z), y, z, matrix[:3, 3]], axis=1)
    return tuple(tuple(row) for row in frame.tolist())


def _unit(vector: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vector)
    return vector / length if length > 0 else otherwise


# --- what is lost ----------------------------------------------------------------------------------------------------


def _losses(thing: bpy.types.Object, matrix: np.ndarray) -> Iterator[tuple[str, str]]:
    light, linking = thing.data, thing.light_linking
    if _of_cycles(light, "is_portal", False):
        yield "", "portal: it guides no rays"
    elif linking.receiver_collection or linking.blocker_collection:
        yield "", "light linking: lights everything"
    if _of_cycles(light, "max_bounces", _MAX_BOUNCES) < _MAX_BOUNCES:
        yield "", f"bounces limited to {light.cycles.max_bounces}: lights all of them"
    if light.type in ("SPOT", "AREA"):
        yield from _distortions(light, matrix)


def _distortions(light: bpy.types.Light, matrix: np.ndarray) -> Iterator[tuple[str, str]]:
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    cosines = (matrix[:3, :3].T @ matrix[:3, :3]) / np.maximum(np.outer(lengths, lengths), 1e-30)
    if (np.abs(cosines[np.triu_indices(3, 1)]) > _STRAIGHT).any():
        yield "", "sheared: as if its axes were perpendicular"
    if light.type == "SPOT" and np.ptp(lengths) > _STRAIGHT * lengths.max():
        yield "", "scaled unevenly: its cone is round"
