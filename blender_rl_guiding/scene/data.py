"""The scene in arrays, as it is exported and rendered: `SceneData`, its key, and what makes a scene impossible to render.

Needs nothing but numpy, because the add-on makes these inside Blender's own Python (3.11 or newer).
World space is Blender's: right-handed, z up, metres.
"""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from . import instances
from .description import CAMERA, VISIBLE, Bounces, Camera, Closure, Film, Lamp, Loss, Node, Shader, Value, emits

TABLE_SIZE = 256
_GRID = 64.0  # metres
_BLOCK = 1 << 16  # triangles, or numbers, whose arithmetic stays in the cache
_FILTERS, _CAMERAS, _LAMPS = (
    ("box", "gaussian", "blackman_harris"),
    ("perspective", "orthographic", "panorama", "hemisphere"),
    ("point", "spot", "sun", "area"),
)

# Every array: type, shape (None: any length) and what it is when a scene has none of it.
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
    srgb: bool  # whether 8-bit colours have to be decoded; alpha never has
    # (H, W, 4) uint8 or float32, RGBA, top row first; whether colours are multiplied by alpha is told where they are read: `ops.Alpha`
    texels: np.ndarray = field(compare=False)
    tile: int = 0  # UDIM number of a tile of an image: 1001 + column + 10 row; 0 for a whole image
    rest: int = 0  # how many textures after it are tiles of the same image, in rising order


@dataclass(frozen=True, eq=False)
class SceneData:
    """Everything that the renderer knows of a scene. Arrays are read-only.

    The first W triangles stand in world space; each belongs to one object. The others make up meshes, each in a space of its own, that
    instances place in the world. The first P objects are made of the W triangles; object P + i is instance i.
    """

    name: str
    vertices: np.ndarray  # (V, 3) float32; those in world space come first, and those of a mesh follow each other
    triangles: np.ndarray  # (T, 3) int32, indices of vertices; those of an object or a mesh follow each other
    normals: np.ndarray  # (T, 3, 3) float32, unit shading normal at each corner
    material: np.ndarray  # (T,) int32, index of shaders; those of meshes do not emit
    object: np.ndarray  # (W,) int32, index of the object that a triangle belongs to; never falls
    shaders: tuple[Shader, ...]
    camera: Camera
    world: Shader = Shader("")
    lamps: tuple[Lamp, ...] = ()
    film: Film = Film()
    bounces: Bounces = Bounces()
    visibility: np.ndarray = field(
        default_factory=lambda: np.full(1, VISIBLE, np.uint8)
    )  # (O,) sum of the kinds of rays that see an object
    world_visibility: int = VISIBLE  # sum of the kinds of rays that see the world
    # What attribute k has at the corners of the t-th triangle of object o: attributes[attribute_rows[k, o] + t]
    attributes: np.ndarray = _none("attributes")  # (N, 3, 3) float32, three numbers at each corner of a triangle
    attribute_rows: np.ndarray = _none("attribute_rows")  # (A, O) int64, -1 where an object does not have the attribute: it is 0 there
    object_attributes: np.ndarray = _none("object_attributes")  # (B, O, 3) float32, what is the same all over an object
    tables: np.ndarray = _none("tables")  # (R, 256, 4) float32, colour ramps and curves over 0..1
    meshes: np.ndarray = _none("meshes")  # (M,) int32, first triangle of each mesh; W is the first of these
    instances: np.ndarray = _none("instances")  # (I,) int32, index of meshes; never falls
    instance_to_world: np.ndarray = _none("instance_to_world")  # (I, 3, 4) float32, from the mesh's space to the world's; invertible
    textures: tuple[Texture, ...] = ()
    coverage: tuple[Loss, ...] = ()

    def __post_init__(self) -> None:
        for name in ARRAYS:
            getattr(self, name).setflags(write=False)
        for texture in self.textures:
            texture.texels.setflags(write=False)

    def __setstate__(self, state: dict[str, Any]) -> None:
        # What another process sent must be as the original: kernels are compiled for arrays that cannot be written to.
        self.__dict__.update(state)
        self.__post_init__()

    @cached_property
    def origin(self) -> np.ndarray:
        """(3,) float32, what the renderer counts positions from, so that rounding is small near the camera however far it is from 0.

        It is the corner of a grid next to the camera, or to the point of the scene's box next to that. As the steps of the grid are
        whole, nothing is rounded by the subtraction; and scenes near 0 stay where they are.
        """
        near = np.clip(np.array(self.camera.to_world)[:3, 3], *self._box)
        origin = (np.round(near / _GRID) * _GRID).astype(np.float32)
        origin.setflags(write=False)
        return origin

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner of a box around the scene, from its origin, (3,) float32 each; of a cube of a metre if it is empty."""
        low, high = self._box
        return low - self.origin, high - self.origin

    @cached_property
    def _box(self) -> tuple[np.ndarray, np.ndarray]:
        return instances.box(self) if len(self.triangles) else (np.full(3, -0.5, np.float32), np.full(3, 0.5, np.float32))

    @cached_property
    def key(self) -> str:
        """SHA-256 of all that the image depends on; names and the coverage report are left out."""
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


def find_fault(scene: SceneData) -> str:
    """The first thing that makes a scene impossible to render, in one line; empty if there is none."""
    return (
        _find_bad_index(scene)
        or instances.find_bad_table(scene)
        or _find_bad_length(scene)
        or _find_bad_object(scene)
        or _find_infinite(scene)
        or _find_flat(scene)
        or instances.find_singular(scene)
        or instances.find_shining(scene)
        or _find_bad_description(scene)
        or _find_bad_shader(scene)
    )


def _find_bad_index(scene: SceneData) -> str:
    for plural, indices, there in (("vertices", scene.triangles, scene.vertices), ("materials", scene.material, scene.shaders)):
        if indices.size and (indices.min() < 0 or indices.max() >= len(there)):
            return f"triangles point to {plural} {indices.min()}..{indices.max()}, but there are {len(there)}"
    return ""


def _find_bad_length(scene: SceneData) -> str:
    in_world = int(scene.meshes[0]) if len(scene.meshes) else len(scene.triangles)
    for name, count in (("material", len(scene.triangles)), ("object", in_world), ("normals", len(scene.triangles))):
        if len(getattr(scene, name)) != count:
            return f"{count} triangles, but {len(getattr(scene, name))} in {name}"
    return ""


def _find_bad_object(scene: SceneData) -> str:
    objects = len(scene.visibility)
    placed = instances.placed(scene)
    if len(scene.object) and (scene.object.min() < 0 or scene.object.max() >= placed or (np.diff(scene.object) < 0).any()):
        return f"triangles belong to objects {scene.object.min()}..{scene.object.max()} of {placed}, which must never fall"
    counts = np.concatenate([np.bincount(scene.object, minlength=placed), instances.sizes(scene)[scene.instances]])
    rows = scene.attribute_rows
    if scene.object_attributes.shape[0] and scene.object_attributes.shape[1] != objects:
        return f"{objects} objects, but object_attributes of {scene.object_attributes.shape[1]}"
    if rows.shape[0] and (
        rows.shape[1] != objects or rows.min(initial=0) < -1 or (np.where(rows < 0, 0, rows + counts) > len(scene.attributes)).any()
    ):
        return f"attribute_rows {rows.shape} do not fit {objects} objects and {len(scene.attributes)} rows of attributes"
    return ""


def _find_infinite(scene: SceneData) -> str:
    arrays = [(name, getattr(scene, name)) for name in ARRAYS] + [(f"texture {t.name!r}", t.texels) for t in scene.textures]
    for name, array in arrays:
        flat = array.reshape(-1) if array.dtype == np.float32 else array[:0]
        for start in range(0, flat.size, _BLOCK):
            if not (finite := np.isfinite(flat[start : start + _BLOCK])).all():
                place = tuple(map(int, np.unravel_index(start + finite.argmin(), array.shape)))
                return f"{name} has {array[place]} at {place}, which is not a finite number"
    return ""


def _find_flat(scene: SceneData) -> str:
    flat = without_area(scene.vertices, scene.triangles)
    return f"triangle {flat.argmax()} is degenerate: it has no area" if flat.any() else ""


def without_area(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(T,) bool, whose corners lie on one line or are one point. Exact up to the rounding of products in double precision."""
    flat = np.empty(len(triangles), bool)
    for start in range(0, len(triangles), _BLOCK):
        a, b, c = vertices.take(triangles[start : start + _BLOCK].T, axis=0)
        (ux, uy, uz), (vx, vy, vz) = ((end.astype(np.float64) - a).T for end in (b, c))
        flat[start : start + _BLOCK] = (uy * vz == uz * vy) & (uz * vx == ux * vz) & (ux * vy == uy * vx)
    return flat


def _find_bad_description(scene: SceneData) -> str:
    if scene.name in ("", "..") or scene.name != Path(scene.name).name:
        return f"the name {scene.name!r} is not one that a folder can have"
    camera, film, window = scene.camera, scene.film, scene.camera.window
    if camera.kind not in _CAMERAS or film.filter not in _FILTERS:
        return f"the camera is {camera.kind!r} and the filter {film.filter!r}, but there are {_CAMERAS} and {_FILTERS}"
    if np.shape(camera.to_world) != (4, 4) or not np.isfinite([*np.ravel(camera.to_world), *window]).all():
        return f"the camera has to_world {camera.to_world} and window {window}"
    if not (window[0] < window[1] and window[2] < window[3] and 0 <= camera.near < camera.far):
        return f"the camera cannot see: {camera}"
    if not (camera.focus > 0 and 0 <= camera.aperture < np.inf and 0 < camera.aperture_ratio < np.inf):
        return f"the camera has no such lens: {camera}"
    if not (0 < film.filter_width < np.inf and 0 <= film.exposure < np.inf):
        return f"the film cannot be exposed: {film}"
    if not (0 < camera.width <= 65536 and 0 < camera.height <= 65536):
        return f"resolution {camera.width} x {camera.height} is out of range"
    if negative := [name for name, value in asdict(scene.bounces).items() if value < 0]:
        return f"bounces: {negative[0]} is negative"
    for lamp in scene.lamps:
        if not -1 <= lamp.shader < len(scene.shaders):
            return f"lamp {lamp.name!r} has shader {lamp.shader}, but there are {len(scene.shaders)}"
    for k, texture in enumerate(scene.textures):
        if not 0 <= texture.rest < len(scene.textures) - k:
            return f"texture {texture.name!r} is followed by {texture.rest} tiles, but there are {len(scene.textures) - k - 1} textures"
    return next(filter(None, map(fault_of_lamp, scene.lamps)), "")


def fault_of_lamp(lamp: Lamp) -> str:
    """What makes a lamp impossible, in one line; empty if nothing does."""
    numbers = (*np.ravel(lamp.to_world), *lamp.emission, lamp.radius, lamp.cone, lamp.blend, lamp.width, lamp.height, lamp.spread)
    impossible = not np.isfinite(numbers).all() or min(*lamp.emission, lamp.radius, lamp.width, lamp.height) < 0
    if lamp.kind not in _LAMPS or np.shape(lamp.to_world) != (4, 4) or impossible:
        return f"lamp {lamp.name!r} is not one: {lamp}"
    return ""


def _find_bad_shader(scene: SceneData) -> str:
    return next(filter(None, map(fault_of_shader, (*scene.shaders, scene.world))), "")


def fault_of_shader(shader: Shader) -> str:
    """What makes a shader impossible, in one line; empty if nothing does."""
    for k, instruction in enumerate(shader.code):
        if any(isinstance(value, Node) and not 0 <= value.index < k for value in instruction.inputs):
            return f"shader {shader.name!r}: step {k}, {instruction.op}, reads a value that is not computed before it"
    for value in (v for closure in shader.closures for v in _values(closure)):
        if isinstance(value, Node) and not 0 <= value.index < len(shader.code):
            return f"shader {shader.name!r}: a closure reads step {value.index} of {len(shader.code)}"
    constants = [v for part in (*shader.code, *shader.closures) for v in _values(part) if not isinstance(v, Node)]
    if bad := [v for v in constants if not np.isfinite(v).all()]:
        return f"shader {shader.name!r} has the value {bad[0]}, which is not finite"
    return ""


def _values(part: Any) -> Iterator[Value]:
    yield from (part.weight, *part.inputs.values()) if isinstance(part, Closure) else part.inputs


def find_nothing(scene: SceneData) -> str:
    """What makes the image of a scene a plain one, in one line: no light, or nothing but the world; empty if nothing does."""
    used = [scene.shaders[m] for m in np.unique(scene.material)]
    if not (scene.lamps or any(emits(closure) for shader in (*used, scene.world) for closure in shader.closures)):
        return "the scene is dark: no lamp, no emitting surface, and the world is black"
    if not len(scene.triangles) and not any(lamp.visibility & CAMERA for lamp in scene.lamps):
        return "the scene is empty: nothing but the world is in the image"
    return ""
