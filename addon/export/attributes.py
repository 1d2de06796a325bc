"""Corner attributes, which shaders read at the corners of triangles: UV maps, coordinates, colours, tangents."""

from collections.abc import Callable
from typing import NamedTuple

import bpy
import numpy as np

from .geometry import Mesh, Triangles, apply, arranged, corner_vertices, loop_triangles, read_array, triangle_faces
from .tangents import tangents

# By the type of an attribute that Cycles reads: the name of its values, and their shape. `color` is linear.
_TYPES: dict[str, tuple[str, tuple[int, ...]]] = {
    "FLOAT": ("value", ()),
    "INT": ("value", ()),
    "INT8": ("value", ()),
    "BOOLEAN": ("value", ()),
    "FLOAT2": ("vector", (2,)),
    "FLOAT_VECTOR": ("vector", (3,)),
    "FLOAT_COLOR": ("color", (4,)),
    "BYTE_COLOR": ("color", (4,)),
    "QUATERNION": ("value", (4,)),
}


class Placed(NamedTuple):
    """An instance of a mesh."""

    key: int  # of the mesh
    data: bpy.types.Mesh
    mesh: Mesh
    triangles: Triangles
    matrix: np.ndarray  # (4, 4) float64, to world space
    depsgraph: bpy.types.Depsgraph  # for coordinates of other objects
    tangents: dict[tuple[int, str], tuple[np.ndarray, np.ndarray]]  # by key and UV map: tangents so far, in the space of the mesh


class Attributes:
    """Collects the corner attributes of a scene, object by object."""

    def __init__(self) -> None:
        self._blocks: list[np.ndarray] = [np.zeros((0, 3, 3), np.float32)]
        self._count = 0
        self._rows: dict[tuple[int, int], int] = {}  # by attribute and owner
        self._shared: dict[tuple, int] = {}  # rows that instances of one mesh share

    def add(self, number: int, key: tuple[str, str], owner: int, placed: Placed) -> bool:
        """Add attribute `number`, of this key in `Resources`, unless the mesh lacks it.

        `owner` is an object, or ~m for all instances of mesh m. Returns whether all numbers are finite; a number that is not becomes 0.
        """
        name = (placed.key, key, placed.triangles.mirrored)
        shared = placed.triangles.kept is None and not depends_on_place(key)
        if shared and name in self._shared:
            self._rows[number, owner] = self._shared[name]
            return True
        values = read(key, placed)
        if values is None:
            return True
        finite = np.isfinite(values)
        if not (faultless := bool(finite.all())):
            values = np.where(finite, values, np.float32(0))
        self._rows[number, owner] = self._count
        if shared:
            self._shared[name] = self._count
        self._blocks.append(np.ascontiguousarray(arranged(values, placed.triangles.kept, placed.triangles.mirrored)))
        self._count += len(self._blocks[-1])
        return faultless

    def arrays(self, attributes: int, objects: int, meshes: int, instances: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`attributes` and `attribute_rows` of `SceneData`; `objects` counts those that are no instances."""
        rows = np.full((attributes, objects + meshes), -1, np.int64)
        for place, row in self._rows.items():
            rows[place] = row  # ~m counts from the end
        return np.concatenate(self._blocks), np.concatenate([rows[:, :objects], rows[:, ~instances]], axis=1)


def read(key: tuple[str, str], placed: Placed) -> np.ndarray | None:
    """(T, 3, 3) float32 at the corners of the triangles of `placed.mesh`; None if it lacks the attribute."""
    kind, name = key
    return _READERS[kind](placed, name)


def depends_on_place(key: tuple[str, str]) -> bool:
    """Whether instances of one mesh differ."""
    kind, name = key
    return kind == "OBJECT" and name != ""


def _uv(placed: Placed, name: str) -> np.ndarray | None:
    mesh = placed.data
    name = name or next((layer.name for layer in mesh.uv_layers if layer.active_render), "")
    return _attribute(placed, name) if name in mesh.uv_layers else None


def _generated(placed: Placed, name: str) -> np.ndarray:
    """0 to 1 across the box of the undeformed mesh, or the texture space that the user has set."""
    mesh = placed.data
    points = read_array(mesh.vertices, "undeformed_co", (3,), np.float32)
    size = np.array(mesh.texspace_size)
    scale = np.where(size, 0.5 / np.where(size, size, 1), 0)
    return apply(np.diag(scale), points, 0.5 - np.array(mesh.texspace_location) * scale).take(_vertices(mesh), axis=0)


def _object(placed: Placed, name: str) -> np.ndarray | None:
    points = placed.mesh.vertices
    if name:
        other = bpy.data.objects.get(name)
        if other is None:
            return None
        to_other = np.linalg.pinv(np.array(other.evaluated_get(placed.depsgraph).matrix_world, np.float64)) @ placed.matrix
        points = apply(to_other[:3, :3], points, to_other[:3, 3])
    return points.take(placed.mesh.corners, axis=0)


def _radial(placed: Placed, name: str) -> np.ndarray:
    """axis x (generated - 1/2); as in Cycles, the axis of Y is -y."""
    axis = np.diag((1.0, -1.0, 1.0))["XYZ".index(name)]
    return np.cross(axis.astype(np.float32), _generated(placed, "") - np.float32(0.5))


def _object_normal(placed: Placed, name: str) -> np.ndarray:
    return placed.mesh.normals.take(placed.mesh.normal, axis=0)


def _parametric(placed: Placed, name: str) -> np.ndarray:
    corners = np.diag(np.array((1, 1, 0), np.float32))
    return np.broadcast_to(corners, (len(placed.mesh.corners), 3, 3))


def _attribute(placed: Placed, name: str) -> np.ndarray | None:
    return _at_corners(placed.data, name, _triples)


def _tangent(placed: Placed, name: str) -> np.ndarray | None:
    both = _tangents(placed, name)
    return None if both is None else both[0]


def _tangent_sign(placed: Placed, name: str) -> np.ndarray | None:
    both = _tangents(placed, name)
    return None if both is None else np.broadcast_to(both[1][:, None, None], both[0].shape)


_READERS: dict[str, Callable[[Placed, str], np.ndarray | None]] = {
    "UV": _uv,
    "GENERATED": _generated,
    "OBJECT": _object,
    "OBJECT_NORMAL": _object_normal,
    "PARAMETRIC": _parametric,
    "RADIAL": _radial,
    "ATTRIBUTE": _attribute,
    "ATTRIBUTE_ALPHA": lambda placed, name: _at_corners(placed.data, name, _alphas),
    "TANGENT": _tangent,
    "TANGENT_SIGN": _tangent_sign,
}


def _tangents(placed: Placed, name: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Tangents (T, 3, 3) and signs (T,)."""
    key, mesh = (placed.key, name), placed.mesh
    if key not in placed.tangents and (uvs := _uv(placed, name)) is not None:
        placed.tangents[key] = tangents(mesh.vertices[mesh.corners], mesh.normals[mesh.normal], uvs[..., :2])
    return placed.tangents.get(key)


def _vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """(T, 3), indices of Blender's vertices. The indices in `Mesh.corners` leave out loose vertices."""
    return corner_vertices(mesh)[loop_triangles(mesh)]


def _at_corners(mesh: bpy.types.Mesh, name: str, form: Callable[[np.ndarray], np.ndarray]) -> np.ndarray | None:
    """(T, 3, 3), an attribute as `_triples` or `_alphas`; the name "" is the colour attribute for rendering."""
    attribute = mesh.attributes.get(name or mesh.attributes.default_color_name or "")
    numbers = _numbers(attribute) if attribute else None
    if attribute is None or numbers is None:
        return None
    values = form(numbers)
    if attribute.domain == "CORNER":
        return values.take(loop_triangles(mesh), axis=0)
    if attribute.domain == "FACE":
        return np.repeat(values[triangle_faces(mesh), None], 3, axis=1)
    return (_of_vertices(mesh, values) if attribute.domain == "EDGE" else values).take(_vertices(mesh), axis=0)


def _numbers(attribute: bpy.types.Attribute) -> np.ndarray | None:
    """(N, n) float32; None if Cycles does not read the type."""
    if attribute.data_type not in _TYPES:
        return None
    field, shape = _TYPES[attribute.data_type]
    return read_array(attribute.data, field, shape, np.float32).reshape(len(attribute.data), -1)


def colors_of(attribute: bpy.types.Attribute) -> np.ndarray | None:
    """(N, 4) float32, linear RGBA, from ATTRIBUTE and ATTRIBUTE_ALPHA; None if Cycles does not read the type."""
    numbers = _numbers(attribute)
    return None if numbers is None else np.concatenate([_triples(numbers), _alphas(numbers)[:, :1]], axis=1)


def _triples(values: np.ndarray) -> np.ndarray:
    """(N, 3) from (N, n): one number repeated three times, two numbers and a zero, or the first three numbers."""
    triples = np.zeros((len(values), 3), np.float32)
    triples[:, : values.shape[1] if values.shape[1] > 1 else 3] = values[:, :3]
    return triples


def _alphas(values: np.ndarray) -> np.ndarray:
    """(N, 3): the fourth number of (N, 4) repeated three times, or ones."""
    return np.repeat(values[:, 3:], 3, axis=1) if values.shape[1] == 4 else np.ones((len(values), 3), np.float32)


def _of_vertices(mesh: bpy.types.Mesh, values: np.ndarray) -> np.ndarray:
    """For each vertex the mean over its edges."""
    ends = read_array(mesh.attributes[".edge_verts"].data, "value", (2,), np.int32).ravel()
    counts = np.bincount(ends, minlength=len(mesh.vertices))
    sums = [np.bincount(ends, np.repeat(column, 2), len(mesh.vertices)) for column in values.T]
    return (np.stack(sums, axis=1) / np.maximum(counts, 1)[:, None]).astype(np.float32)
