"""What Cycles would blur: whatever moves while the shutter is open, from whatever source."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import bpy
import numpy as np

from blender_rl_guiding.scene.description import Loss

from .geometry import evaluated_mesh, read_array
from .visibility import visibility

FrameSet = Callable[[int, float], None]  # of a render engine: evaluates the depsgraph it renders at a frame and a share of the next
_STILL = 1e-6  # relative to the largest number of a transform
_DETAIL = "motion blur: it stands still at the frame's own time"


class _State(NamedTuple):
    """Of an instance at one time."""

    name: str
    matrix: np.ndarray | None  # (4, 4), to world space; None where Cycles does not blur it
    shape: tuple[int, int] | None  # number of vertices, and a digest of where they are; None likewise


def of_motion(depsgraph: bpy.types.Depsgraph, frame_set: FrameSet) -> Iterator[Loss]:
    """A line for the camera and each object that is elsewhere, or of another shape, when the shutter opens or closes.

    Afterwards the depsgraph is what it was, but whatever has been taken from it before is no longer there.
    """
    scene = depsgraph.scene
    if not (scene.render.use_motion_blur and depsgraph.view_layer.use_motion_blur):
        return
    frame = scene.frame_current + scene.frame_subframe
    now = _states(depsgraph)
    moved: dict[Loss, None] = {}
    for time in _shutter(scene.render, frame):
        frame_set(*_split(time))
        then = _states(depsgraph)
        moved.update((Loss(state.name, "", _DETAIL), None) for key, state in now.items() if key in then and _moves(state, then[key]))
    frame_set(*_split(frame))
    yield from moved


def _split(time: float) -> tuple[int, float]:
    frame = int(np.floor(time))
    return frame, time - frame


def _shutter(render: bpy.types.RenderSettings, frame: float) -> tuple[float, float]:
    """When it opens and closes, in frames."""
    before = {"START": 0.0, "CENTER": 0.5, "END": 1.0}[render.motion_blur_position]
    opens = frame - before * render.motion_blur_shutter
    return opens, opens + render.motion_blur_shutter


def _moves(a: _State, b: _State) -> bool:
    if a.matrix is not None and b.matrix is not None and np.abs(a.matrix - b.matrix).max() > _STILL * max(np.abs(a.matrix).max(), 1.0):
        return True
    # Where the number of vertices differs Cycles cannot tell which is which, and blurs nothing.
    return a.shape is not None and b.shape is not None and a.shape[0] == b.shape[0] and a.shape != b.shape


def _states(depsgraph: bpy.types.Depsgraph) -> dict[tuple, _State]:
    """Of the camera and of all instances of meshes that render, by what they are known by at other times, too."""
    camera, shapes = depsgraph.scene.camera.evaluated_get(depsgraph), {}
    states: dict[tuple, _State] = {(): _State(camera.name, _camera(camera), None)}
    for instance in depsgraph.object_instances:
        thing = instance.object
        if instance.show_self and isinstance(thing.data, bpy.types.Mesh) and visibility(instance, depsgraph.view_layer):
            key = thing.name, instance.parent.name if instance.is_instance else "", *instance.persistent_id
            matrix = np.array(instance.matrix_world) if _blurs(instance, "use_motion_blur") else None
            shape = _shape(thing, shapes) if _blurs(instance, "use_deform_motion") and matrix is not None else None
            states[key] = _State(thing.name, matrix, shape)
    return states


def _camera(thing: bpy.types.Object) -> np.ndarray:
    return np.append(np.array(thing.matrix_world), thing.data.lens)


def _blurs(instance: bpy.types.DepsgraphObjectInstance, switch: str) -> bool:
    """Whether Cycles' switch is on, at whoever makes the instances, too."""
    owners = (instance.object, instance.parent) if instance.is_instance else (instance.object,)
    return all(getattr(owner.cycles, switch) for owner in owners if hasattr(owner, "cycles"))


def _shape(thing: bpy.types.Object, known: dict[int, tuple[int, int]]) -> tuple[int, int]:
    key = thing.data.as_pointer()
    if key not in known:
        with evaluated_mesh(thing) as mesh:
            known[key] = len(mesh.vertices), hash(read_array(mesh.vertices, "co", (3,), np.float32).tobytes())
    return known[key]
