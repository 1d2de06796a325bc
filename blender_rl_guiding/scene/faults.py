"""Finds faults that make a scene impossible to render, or its image uniform. Needs only numpy, like `data`."""

import json
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np

from ..strings import fault_of_name
from ..typed import MalformedError, read
from .data import ARRAYS, BLOCK, SceneData, placed, sizes, world_vertices
from .description import CAMERA, FARTHEST, LARGEST, MOST, VISIBLE, Closure, Header, Lamp, Node, Shader, Value, emits

_LEAST_DETERMINANT = 1e-24  # a matrix with a smaller determinant has no inverse in float32


def find_fault(scene: SceneData) -> str:
    """The first fault that makes a scene impossible to render, in one line; empty if there is none."""
    return _misdescribed(Header, scene.header(), "header") or find_misfit(scene)


def find_misfit(scene: SceneData) -> str:
    """The first inconsistency of a scene, in one line; empty if there is none. Types and limits must have been checked before.

    Kernels do not check indices. This function proves that every index in a bundle is inside its array, except the options of shaders:
    `shading.program.check` proves these. Kernels clamp each index that they compute from numbers.
    """
    return (
        _find_too_long(scene)
        or _find_bad_index(scene)
        or _find_bad_table(scene)
        or _find_bad_length(scene)
        or _find_bad_object(scene)
        or _find_bad_attribute(scene)
        or _find_infinite(scene)
        or _find_flat(scene)
        or _find_singular(scene)
        or _find_far(scene)
        or _find_shining(scene)
        or _find_bad_name(scene)
        or _find_bad_camera(scene)
        or _find_bad_reference(scene)
        or next(filter(None, map(_find_bad_step, (*scene.shaders, scene.world))), "")
    )


def _misdescribed(kind: Any, values: dict[str, Any], name: str) -> str:
    """The error of `typed.read` for these values, written as in a bundle; empty if there is none."""
    try:
        read(kind, json.loads(json.dumps(values)), name)
    except MalformedError as error:
        return str(error)
    return ""


def _find_too_long(scene: SceneData) -> str:
    """The first array that is too long, in one line; empty if there is none.

    Kernels count in 32 bits, and compute attribute rows as differences of such numbers.
    """
    for name in ARRAYS:
        if max(shape := getattr(scene, name).shape) > MOST:
            return f"{name} of {shape} has more than {MOST} rows"
    return ""


def _find_bad_index(scene: SceneData) -> str:
    """A bad index in `triangles` (readers: tracing/geometry, lights/emitters, Embree) or `material` (reader: every hit)."""
    for plural, indices, there in (("vertices", scene.triangles, scene.vertices), ("materials", scene.material, scene.shaders)):
        if indices.size and (indices.min() < 0 or indices.max() >= len(there)):
            return f"triangles point to {plural} {indices.min()}..{indices.max()}, but there are {len(there)}"
    return ""


def _find_bad_table(scene: SceneData) -> str:
    """The first fault in the indices of meshes and instances, in one line; empty if there is none."""
    meshes, instances, triangles = scene.meshes, scene.instances, len(scene.triangles)
    if len(meshes) and (meshes.min() < 0 or meshes.max() >= triangles or (meshes[1:] <= meshes[:-1]).any()):
        return f"meshes begin at triangles {meshes.min()}..{meshes.max()} of {triangles}, which must rise"
    if len(meshes) and scene.triangles[: meshes[0]].max(initial=-1) >= world_vertices(scene):
        return f"vertex {world_vertices(scene)} is of a mesh, but vertices of triangles in the world follow"
    if len(meshes) and not len(instances):
        return f"{len(meshes)} meshes of instances, but no instances"
    if len(instances) != len(scene.instance_to_world) or len(instances) > len(scene.visibility):
        return f"{len(instances)} instances, but {len(scene.instance_to_world)} instance_to_world and {len(scene.visibility)} objects"
    if len(instances) and (instances.min() < 0 or instances.max() >= len(meshes) or (instances[1:] < instances[:-1]).any()):
        return f"instances are of meshes {instances.min()}..{instances.max()} of {len(meshes)}, which must never fall"
    return ""


def _find_bad_length(scene: SceneData) -> str:
    in_world = int(scene.meshes[0]) if len(scene.meshes) else len(scene.triangles)
    for name, count in (("material", len(scene.triangles)), ("object", in_world), ("normals", len(scene.triangles))):
        if len(getattr(scene, name)) != count:
            return f"{count} triangles, but {len(getattr(scene, name))} in {name}"
    return ""


def _find_bad_object(scene: SceneData) -> str:
    """A bad index in `object`: kernels use it to read visibility, attributes and matrices.

    Embree's results index triangles and instances, which exist.
    """
    count = placed(scene)
    if len(scene.object) and (scene.object.min() < 0 or scene.object.max() >= count or (scene.object[1:] < scene.object[:-1]).any()):
        return f"triangles belong to objects {scene.object.min()}..{scene.object.max()} of {count}, which must never fall"
    if scene.visibility.max(initial=0) > VISIBLE:
        return f"visibility has {scene.visibility.max()}, but {VISIBLE} is all kinds of rays"
    return ""


def _find_bad_attribute(scene: SceneData) -> str:
    """A bad index in `attribute_rows` (readers: `attribute` and `moved` of shading.geometry), or a bad width of the objects' tables."""
    objects, rows = len(scene.visibility), scene.attribute_rows
    if len(scene.object_attributes) and scene.object_attributes.shape[1] != objects:
        return f"{objects} objects, but object_attributes of {scene.object_attributes.shape[1]}"
    triangles = np.concatenate([np.bincount(scene.object, minlength=placed(scene)), sizes(scene)[scene.instances]])  # per object
    if len(rows) and (
        rows.shape[1] != objects
        or rows.min(initial=0) < -1
        or ((rows >= 0) & (rows > len(scene.attributes) - triangles)).any()  # not as a sum, which could overflow
    ):
        return f"attribute_rows {rows.shape} do not fit {objects} objects and {len(scene.attributes)} rows of attributes"
    return ""


def _find_infinite(scene: SceneData) -> str:
    arrays = [(name, getattr(scene, name)) for name in ARRAYS] + [(f"texture {t.name!r}", t.texels) for t in scene.textures]
    for name, array in arrays:
        flat = array.reshape(-1) if array.dtype == np.float32 else array[:0]
        for start in range(0, flat.size, BLOCK):
            if not (finite := np.isfinite(flat[start : start + BLOCK])).all():
                place = tuple(map(int, np.unravel_index(start + finite.argmin(), array.shape)))
                return f"{name} has {array[place]} at {place}, which is not a finite number"
    return ""


def _find_flat(scene: SceneData) -> str:
    flat = without_area(scene.vertices, scene.triangles)
    return f"triangle {flat.argmax()} is degenerate: it has no area" if flat.any() else ""


def without_area(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(T,) bool, whether a triangle's corners are on one line or equal. Exact, except for the rounding of products in float64."""
    flat = np.empty(len(triangles), bool)
    for start in range(0, len(triangles), BLOCK):
        a, b, c = vertices.take(triangles[start : start + BLOCK].T, axis=0)
        (ux, uy, uz), (vx, vy, vz) = ((end.astype(np.float64) - a).T for end in (b, c))
        flat[start : start + BLOCK] = (uy * vz == uz * vy) & (uz * vx == ux * vz) & (ux * vy == uy * vx)
    return flat


def _find_singular(scene: SceneData) -> str:
    """The first instance whose matrix has no inverse, in one line; empty if there is none."""
    for start in range(0, len(scene.instances), BLOCK):
        if not (good := _invertible(scene.instance_to_world[start : start + BLOCK])).all():
            return f"instance {start + good.argmin()} has a matrix without an inverse"
    return ""


def _invertible(matrices: np.ndarray) -> np.ndarray:
    """(N,) bool: whether the left 3 x 3 of each matrix has an inverse. matrices: (N, 3, 3 or 4)."""
    rows = matrices[:, :, :3].astype(np.float64)
    return np.abs((np.cross(rows[:, 0], rows[:, 1]) * rows[:, 2]).sum(axis=1)) > _LEAST_DETERMINANT


def _find_far(scene: SceneData) -> str:
    """A thing further than FARTHEST, in one line; empty if there is none. Embree ignores such triangles; squared distances overflow."""
    places = {"the camera": scene.camera.to_world} | {f"lamp {lamp.name!r}": lamp.to_world for lamp in scene.lamps}
    far = [name for name, matrix in places.items() if max(abs(row[3]) for row in matrix[:3]) > FARTHEST]
    if max(scene.vertices.max(initial=0), -scene.vertices.min(initial=0)) > FARTHEST:
        far.append("a vertex")
    if far:
        return f"{far[0]} is more than {FARTHEST:g} metres away"
    with np.errstate(over="ignore"):
        near = (np.abs(scene.bounds) <= 2 * FARTHEST).all()  # bounds are relative to the scene's origin
    return "" if near else f"an instance is more than {FARTHEST:g} metres away"


def _find_shining(scene: SceneData) -> str:
    """The first emitting material of an instanced mesh, in one line; empty if there is none.

    Such meshes must not emit, because light sampling picks single triangles in world space.
    """
    for shader in np.unique(scene.material[len(scene.object) :]):
        if any(map(emits, scene.shaders[shader].closures)):
            return f"a mesh of instances emits, by shader {scene.shaders[shader].name!r}"
    return ""


def _find_bad_name(scene: SceneData) -> str:
    fault = fault_of_name(scene.name)
    return f"the name {scene.name!r} {fault}" if fault else ""


def _find_bad_camera(scene: SceneData) -> str:
    camera, (left, right, bottom, top) = scene.camera, scene.camera.window
    if not (0 < right - left <= LARGEST and 0 < top - bottom <= LARGEST and camera.near < camera.far):
        return f"the camera cannot see: {camera}"
    return ""


def _find_bad_reference(scene: SceneData) -> str:
    """A bad shader of a lamp (reader: `lights.lamp_shaders`), or bad tiles of a texture (reader: `shading.textures.find_tile`)."""
    for lamp in scene.lamps:
        if lamp.shader >= len(scene.shaders):
            return f"lamp {lamp.name!r} has shader {lamp.shader}, but there are {len(scene.shaders)}"
    for k, texture in enumerate(scene.textures):
        if texture.rest >= len(scene.textures) - k:
            return f"texture {texture.name!r} is followed by {texture.rest} tiles, but there are {len(scene.textures) - k - 1} textures"
    return ""


def fault_of_lamp(lamp: Lamp) -> str:
    """The fault of a lamp, in one line; empty if it has none."""
    return _misdescribed(Lamp, asdict(lamp), f"lamp {lamp.name!r}")


def fault_of_shader(shader: Shader) -> str:
    """The fault of a shader, in one line; empty if it has none."""
    return _misdescribed(Shader, asdict(shader), f"shader {shader.name!r}") or _find_bad_step(shader)


def _find_bad_step(shader: Shader) -> str:
    """A step or closure that reads a step which does not exist or comes later. `shading.program` gives each step a register."""
    for k, instruction in enumerate(shader.code):
        if any(isinstance(value, Node) and not 0 <= value.index < k for value in instruction.inputs):
            return f"shader {shader.name!r}: step {k}, {instruction.op}, reads a value that is not computed before it"
    for value in (v for closure in shader.closures for v in _values(closure)):
        if isinstance(value, Node) and not 0 <= value.index < len(shader.code):
            return f"shader {shader.name!r}: a closure reads step {value.index} of {len(shader.code)}"
    return ""


def _values(closure: Closure) -> Iterator[Value]:
    yield from (closure.weight, *closure.inputs.values())


def find_nothing(scene: SceneData) -> str:
    """The reason for a uniform image, in one line: no light, or only the world. Empty if the image is not uniform."""
    used = [scene.shaders[m] for m in np.unique(scene.material)]
    if not (scene.lamps or any(emits(closure) for shader in (*used, scene.world) for closure in shader.closures)):
        return "the scene is dark: no lamp, no emitting surface, and the world is black"
    if not len(scene.triangles) and not any(lamp.visibility & CAMERA for lamp in scene.lamps):
        return "the scene is empty: nothing but the world is in the image"
    return ""
