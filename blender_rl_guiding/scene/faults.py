"""What makes a scene impossible to render, or its image a plain one. Needs nothing but numpy, as `data` does."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np

from ..strings import fault_of_name
from . import instances
from .data import ARRAYS, SceneData
from .description import CAMERA, Closure, Lamp, Node, Shader, Value, emits

_BLOCK = 1 << 16  # triangles, or numbers, whose arithmetic stays in the cache
_FILTERS, _CAMERAS, _LAMPS = (
    ("box", "gaussian", "blackman_harris"),
    ("perspective", "orthographic", "panorama", "hemisphere"),
    ("point", "spot", "sun", "area"),
)


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
    if fault := fault_of_name(scene.name):
        return f"the name {scene.name!r} {fault}"
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
