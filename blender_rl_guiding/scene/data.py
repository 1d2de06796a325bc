"""The scene in arrays, as it is exported and rendered: `SceneData`, and its key.

Needs only numpy, because the add-on makes these objects inside Blender's own Python (3.11 or newer).
World space is Blender's: right-handed, z up, metres.
"""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from .description import VISIBLE, Bounces, Camera, Film, Lamp, Loss, Shader

TABLE_SIZE = 256
BLOCK = 1 << 16  # instances, triangles or numbers at a time: the arithmetic stays in the processor's cache
_GRID = 64.0  # metres

# Type and shape of every array; None stands for any length.
ARRAYS: dict[str, tuple[type, tuple[int | None, ...]]] = {
    "vertices": (np.float32, (None, 3)),
    "triangles": (np.int32, (None, 3)),
    "normals": (np.float32, (None, 3, 3)),
    "material": (np.int32, (None,)),
    "object": (np.int32, (None,)),
    "visibility": (np.uint8, (None,)),
    "attributes": (np.float32, (None, 3, 3)),
    "attribute_rows": (np.int64, (None, None)),
    "object_attributes": (np.float32, (None, None, 3)),
    "tables": (np.float32, (None, TABLE_SIZE, 4)),
    "meshes": (np.int32, (None,)),
    "instances": (np.int32, (None,)),
    "instance_to_world": (np.float32, (None, 3, 4)),
}
_OF_INSTANCES = "meshes", "instances", "instance_to_world"


def _none(name: str) -> Any:
    """A field for an array that is empty unless given."""
    dtype, shape = ARRAYS[name]
    return field(default_factory=lambda: np.zeros([length or 0 for length in shape], dtype))


@dataclass(frozen=True)
class Texture:
    """An image for shaders. 8-bit texels are stored codes."""

    name: str
    srgb: bool  # whether 8-bit colours are sRGB codes, which lookups decode; alpha is always linear
    # (H, W, 4) uint8 or float32, RGBA, top row first. The option `ops.Alpha` of each reading instruction says how alpha is used.
    texels: np.ndarray = field(compare=False)
    tile: int = 0  # UDIM number of a tile of an image: 1001 + column + 10 row; 0 for a whole image
    rest: int = 0  # number of textures after this one that are tiles of the same image, in rising order of `tile`


@dataclass(frozen=True, eq=False)
class SceneData:
    """All that the renderer knows about a scene. Arrays are read-only.

    The first W triangles are in world space; each belongs to one object. The other triangles form meshes, each in its own space.
    Instances place meshes in the world. The first P objects consist of the W triangles; object P + i is instance i.
    """

    name: str
    vertices: np.ndarray  # (V, 3) float32; vertices in world space come first, then those of each mesh, one mesh after another
    triangles: np.ndarray  # (T, 3) int32, indices of vertices; the triangles of an object or a mesh are consecutive
    normals: np.ndarray  # (T, 3, 3) float32, unit shading normal at each corner
    material: np.ndarray  # (T,) int32, index of shaders; shaders of meshes do not emit
    object: np.ndarray  # (W,) int32, index of the object that a triangle belongs to; never decreases
    shaders: tuple[Shader, ...]
    camera: Camera
    world: Shader = Shader("")
    lamps: tuple[Lamp, ...] = ()
    film: Film = Film()
    bounces: Bounces = Bounces()
    visibility: np.ndarray = field(
        default_factory=lambda: np.full(1, VISIBLE, np.uint8)
    )  # (O,) for each object: sum of the kinds of rays that see it
    world_visibility: int = VISIBLE  # sum of the kinds of rays that see the world
    # Attribute k at the corners of triangle t of object o: attributes[attribute_rows[k, o] + t]
    attributes: np.ndarray = _none("attributes")  # (N, 3, 3) float32, three numbers at each corner of a triangle
    attribute_rows: np.ndarray = _none("attribute_rows")  # (A, O) int64, -1 if an object lacks the attribute; the value is then 0
    object_attributes: np.ndarray = _none("object_attributes")  # (B, O, 3) float32, values that are constant over an object
    tables: np.ndarray = _none("tables")  # (R, 256, 4) float32, colour ramps and curves over 0..1
    meshes: np.ndarray = _none("meshes")  # (M,) int32, first triangle of each mesh; meshes[0] = W
    instances: np.ndarray = _none("instances")  # (I,) int32, index of meshes; never decreases
    instance_to_world: np.ndarray = _none("instance_to_world")  # (I, 3, 4) float32, from the mesh's space to the world's; invertible
    textures: tuple[Texture, ...] = ()
    coverage: tuple[Loss, ...] = ()

    def __post_init__(self) -> None:
        for name in ARRAYS:
            getattr(self, name).setflags(write=False)
        for texture in self.textures:
            texture.texels.setflags(write=False)

    def __setstate__(self, state: dict[str, Any]) -> None:
        # Arrays from another process arrive writeable, but kernels are compiled for read-only ones.
        self.__dict__.update(state)
        self.__post_init__()

    @cached_property
    def origin(self) -> np.ndarray:
        """The origin of the renderer's positions, (3,) float32, metres. Rounding is then small near the camera, also far from 0.

        It is the point of a grid of 64 m that is nearest to the camera, or to the point of the scene's box nearest to the camera. Grid
        coordinates are whole numbers, so the subtraction does not round. Scenes near 0 have the origin 0.
        """
        near = np.clip(np.array(self.camera.to_world)[:3, 3], *self._box)
        origin = (np.round(near / _GRID) * _GRID).astype(np.float32)
        origin.setflags(write=False)
        return origin

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner of a box around the scene, relative to `origin`, (3,) float32 each; a cube of 1 m if it is empty."""
        low, high = self._box
        return low - self.origin, high - self.origin

    @cached_property
    def _box(self) -> tuple[np.ndarray, np.ndarray]:
        return _box_of(self) if len(self.triangles) else (np.full(3, -0.5, np.float32), np.full(3, 0.5, np.float32))

    @cached_property
    def key(self) -> str:
        """SHA-256 of everything that the image depends on, so without names and the coverage report."""
        header = self.header()
        for part in (*header["shaders"], header["world"], *header["lamps"], *header["textures"]):
            del part["name"]
        shown = {k: v for k, v in header.items() if k not in ("name", "coverage")}
        digest = hashlib.sha256(json.dumps(shown, sort_keys=True).encode())
        names = [name for name in ARRAYS if len(self.meshes) or name not in _OF_INSTANCES]
        for array in (*(getattr(self, name) for name in names), *(t.texels for t in self.textures)):
            digest.update(repr(array.shape).encode())
            digest.update(np.ascontiguousarray(array).data)
        return digest.hexdigest()

    def header(self) -> dict[str, Any]:
        """All that is not an array, as plain data for JSON."""
        return {
            "name": self.name,
            "shaders": [asdict(s) for s in self.shaders],
            "camera": asdict(self.camera),
            "world": asdict(self.world),
            "world_visibility": self.world_visibility,
            "lamps": [asdict(lamp) for lamp in self.lamps],
            "film": asdict(self.film),
            "bounces": asdict(self.bounces),
            "textures": [{"name": t.name, "srgb": t.srgb, "tile": t.tile, "rest": t.rest} for t in self.textures],
            "coverage": [asdict(loss) for loss in self.coverage],
        }


# --- triangles of objects and meshes, and their places ---------------------------------------------------------------


def runs(values: np.ndarray) -> Iterator[tuple[int, int]]:
    """First and end of each run of equal values."""
    starts = np.flatnonzero(np.diff(values, prepend=values[:1] - 1))
    return pairwise([*starts.tolist(), len(values)])


def placed(scene: SceneData) -> int:
    """P, the number of objects that are not instances."""
    return len(scene.visibility) - len(scene.instances)


def first_triangles(scene: SceneData) -> np.ndarray:
    """(O,) the first triangle of each object."""
    return np.concatenate([np.searchsorted(scene.object, np.arange(placed(scene))), scene.meshes[scene.instances]])


def sizes(scene: SceneData) -> np.ndarray:
    """(M,) triangles of each mesh."""
    return np.diff(scene.meshes, append=len(scene.triangles))


def world_vertices(scene: SceneData) -> int:
    """The number of vertices in world space."""
    return int(scene.triangles[scene.meshes[0] :].min()) if len(scene.meshes) else len(scene.vertices)


def _box_of(scene: SceneData) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corner, (3,) float32, of a box around world vertices and boxes of instances (not their vertices)."""
    world = scene.vertices[: world_vertices(scene)]
    corners = [np.stack([world.min(axis=0), world.max(axis=0)])] if len(world) else []
    corners += [np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)]) for boxes in boxes_of(scene)]
    return np.min(corners, axis=0)[0], np.max(corners, axis=0)[1]


def boxes_of(scene: SceneData) -> Iterator[np.ndarray]:
    """Yields (n, 2, 3) float32: lowest and highest corner of the boxes of the next n instances, in order."""
    ends = scene.meshes + sizes(scene)
    for first, end in runs(scene.instances):
        mesh = scene.instances[first]
        corners = scene.triangles[scene.meshes[mesh] : ends[mesh]]
        vertices = scene.vertices[corners.min() : corners.max() + 1]
        low, high = vertices.min(axis=0).astype(np.float64), vertices.max(axis=0).astype(np.float64)
        for start in range(first, end, BLOCK):
            yield _placed_boxes(scene.instance_to_world[start : min(start + BLOCK, end)], low, high)


def _placed_boxes(matrices: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    middle = matrices[:, :, :3] @ ((low + high) / 2) + matrices[:, :, 3]
    half = np.abs(matrices[:, :, :3]) @ ((high - low) / 2)
    return np.stack([middle - half, middle + half], axis=1).astype(np.float32)
