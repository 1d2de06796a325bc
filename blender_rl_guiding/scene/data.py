"""The scene bundle: one .npz of arrays and a JSON header, the interface between Blender and the renderer.

Needs nothing but numpy, because the add-on writes bundles inside Blender's own Python (3.11 or newer).
World space is Blender's: right-handed, z up, metres.
"""

import hashlib
import json
import operator
import tokenize
import zipfile
import zlib
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, atomic

VERSION = 1
_BLOCK = 1 << 16  # triangles whose arithmetic stays in the cache
_ARRAYS = {"vertices": (np.float32, (3,)), "triangles": (np.int32, (3,)), "normals": (np.float32, (3, 3)), "material": (np.int32, ())}
# What numpy, zipfile and json raise where a byte is wrong; NotImplementedError is a RuntimeError, UnicodeError a ValueError.
_DAMAGE = (zipfile.BadZipFile, zlib.error, tokenize.TokenError, SyntaxError, EOFError, ArithmeticError, AttributeError)
_DAMAGE += (LookupError, RuntimeError, TypeError, ValueError)


@dataclass(frozen=True)
class Material:
    """A diffuse reflector that may emit, on both sides alike, as Cycles' mesh lights do."""

    name: str
    base_color: tuple[float, float, float]  # albedo, linear RGB, 0..1
    emission: tuple[float, float, float]  # radiance, linear RGB, W / (m^2 sr)


@dataclass(frozen=True)
class Camera:
    """A pinhole. Looks along -z of `to_world` with +y up, as Blender's cameras do; pixel (0, 0) is at the top left."""

    to_world: tuple[tuple[float, ...], ...]  # 4 x 4, rows; the upper 3 x 3 is a rotation
    tan_x: float  # half the film's width at distance 1
    tan_y: float  # half the film's height at distance 1
    width: int  # pixels
    height: int


@dataclass(frozen=True)
class Loss:
    """One thing of the scene that the bundle could not take over: a line of the coverage report."""

    object: str  # name of the object, or of the world or scene
    where: str  # "material 'Glass', node 'Glass BSDF'"; empty for the object as a whole
    detail: str  # what is lost, and what stands in its place


@dataclass(frozen=True, eq=False)
class SceneData:
    """Everything that the renderer knows of a scene. Arrays are read-only."""

    name: str
    vertices: np.ndarray  # (V, 3) float32, world space
    triangles: np.ndarray  # (T, 3) int32, indices of vertices
    normals: np.ndarray  # (T, 3, 3) float32, unit shading normal at each corner
    material: np.ndarray  # (T,) int32, index of materials
    materials: tuple[Material, ...]
    camera: Camera
    world: tuple[float, float, float]  # constant radiance of the surroundings, linear RGB
    max_bounces: int  # scattering events of the longest path, as the .blend asks for
    coverage: tuple[Loss, ...] = field(default=())

    def __post_init__(self) -> None:
        for name in _ARRAYS:
            getattr(self, name).setflags(write=False)

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner of the box around the scene, (3,) float32 each."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    @cached_property
    def key(self) -> str:
        """SHA-256 of all that the image depends on; names and the coverage report are left out."""
        header = _header(self)
        shown = {k: header[k] for k in ("version", "camera", "world", "max_bounces")}
        shown["materials"] = [[m.base_color, m.emission] for m in self.materials]
        digest = hashlib.sha256(json.dumps(shown, sort_keys=True).encode())
        for name in _ARRAYS:
            digest.update(np.ascontiguousarray(getattr(self, name)).tobytes())
        return digest.hexdigest()


def _header(scene: SceneData) -> dict[str, Any]:
    return {
        "version": VERSION,
        "name": scene.name,
        "materials": [asdict(m) for m in scene.materials],
        "camera": asdict(scene.camera),
        "world": scene.world,
        "max_bounces": scene.max_bounces,
        "coverage": [asdict(loss) for loss in scene.coverage],
    }


def save(scene: SceneData, path: Path) -> None:
    """Write the bundle under a temporary name, then rename. InputError where the place cannot be written."""
    arrays = {name: getattr(scene, name) for name in _ARRAYS}
    with atomic(path) as part, part.open("wb") as file:
        np.savez(file, header=np.array(json.dumps(_header(scene))), **arrays)


def load(path: Path) -> SceneData:
    """Read and check a bundle. InputError names what is wrong with it in one line."""
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:  # numpy forgets to close what it cannot read
            header = json.loads(str(file["header"]))
            arrays = {name: file[name] for name in _ARRAYS}
        if header["version"] != VERSION:
            raise InputError(f"{path}: bundle version {header['version']}, but this program reads version {VERSION}: export it again")
        scene = _from_header(header, arrays)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except _DAMAGE as error:
        raise InputError(f"{path}: not a scene bundle, or damaged ({_one_line(error)})") from error
    if fault := find_fault(scene):
        raise InputError(f"{path}: {fault}")
    return scene


def _from_header(header: dict[str, Any], arrays: dict[str, np.ndarray]) -> SceneData:
    for name, (dtype, shape) in _ARRAYS.items():
        if arrays[name].dtype != dtype or not arrays[name].ndim or arrays[name].shape[1:] != shape:
            raise ValueError(f"{name} is {arrays[name].dtype}{arrays[name].shape}")
    camera = header["camera"]
    return SceneData(
        name=str(header["name"]),
        materials=tuple(Material(str(m["name"]), _rgb(m["base_color"]), _rgb(m["emission"])) for m in header["materials"]),
        camera=Camera(
            to_world=tuple(map(tuple, np.array(camera["to_world"], np.float64).tolist())),
            tan_x=float(camera["tan_x"]),
            tan_y=float(camera["tan_y"]),
            width=operator.index(camera["width"]),
            height=operator.index(camera["height"]),
        ),
        world=_rgb(header["world"]),
        max_bounces=operator.index(header["max_bounces"]),
        coverage=tuple(Loss(**loss) for loss in header["coverage"]),
        **arrays,
    )


def _rgb(values: Any) -> tuple[float, float, float]:
    r, g, b = map(float, values)
    return r, g, b


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def find_fault(scene: SceneData) -> str:
    """The first thing that makes a scene impossible to render, in one line; empty if there is none."""
    triangles, materials = scene.triangles, len(scene.materials)
    if not len(triangles):
        return "the scene is empty: no triangles"
    if triangles.min() < 0 or triangles.max() >= len(scene.vertices):
        return f"triangles point to vertices {triangles.min()}..{triangles.max()}, but there are {len(scene.vertices)}"
    if len(scene.material) != len(triangles) or len(scene.normals) != len(triangles):
        return f"{len(triangles)} triangles, but {len(scene.material)} material indices and {len(scene.normals)} normals"
    if scene.material.min() < 0 or scene.material.max() >= materials:
        return f"triangles point to materials {scene.material.min()}..{scene.material.max()}, but there are {materials}"
    if fault := _find_bad_triangle(scene) or _find_bad_description(scene):
        return fault
    lit = any(any(scene.materials[m].emission) for m in np.unique(scene.material))
    if not lit and not any(scene.world):
        return "the scene has no light: no emitting surface, and the world is black"
    return ""


def _find_bad_triangle(scene: SceneData) -> str:
    for start in range(0, len(scene.triangles), _BLOCK):
        corners = scene.vertices[scene.triangles[start : start + _BLOCK]]
        bad = ~np.isfinite(corners).all(axis=(1, 2)) | ~np.isfinite(scene.normals[start : start + _BLOCK]).all(axis=(1, 2))
        if bad.any():
            return f"triangle {start + bad.argmax()} has a vertex or normal that is not a finite number"
        a, b = (corners[:, k].astype(np.float64) - corners[:, 0] for k in (1, 2))
        flat = ~np.any([a[:, i] * b[:, j] != a[:, j] * b[:, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=0)
        if flat.any():
            return f"triangle {start + flat.argmax()} is degenerate: it has no area"
    return ""


def _find_bad_description(scene: SceneData) -> str:
    if not scene.name or scene.name != Path(scene.name).name:
        return f"the name {scene.name!r} is not one that a folder can have"
    for m in scene.materials:
        if not np.isfinite(m.base_color + m.emission).all() or min(m.base_color + m.emission) < 0 or max(m.base_color) > 1:
            return f"material {m.name!r} has base_color {m.base_color} and emission {m.emission}: must be finite, >= 0, base_color <= 1"
    c = scene.camera
    if np.shape(c.to_world) != (4, 4) or not np.isfinite(c.to_world).all() or not (0 < c.tan_x < np.inf and 0 < c.tan_y < np.inf):
        return f"the camera is not a pinhole: to_world {c.to_world}, tan_x {c.tan_x}, tan_y {c.tan_y}"
    if not (0 < c.width <= 65536 and 0 < c.height <= 65536) or not np.isfinite(scene.world).all() or min(scene.world) < 0:
        return f"resolution {c.width} x {c.height} or world {scene.world} is out of range"
    return "" if scene.max_bounces >= 0 else f"max_bounces {scene.max_bounces} is negative"
