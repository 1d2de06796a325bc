"""Losses from motion blur: each object that moves while the shutter is open."""

from array import array
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import NamedTuple

import bpy
import numpy as np

from blender_rl_guiding.scene.description import Loss

from .geometry import UNREADABLE, evaluated_mesh, read_array
from .visibility import visibility

FrameSet = Callable[[int, float], None]  # method of a render engine: evaluates its depsgraph at (frame, subframe)
_STILL = 1e-6  # relative to the largest number of a transform
_DETAIL = "motion blur: it stands still at the frame's own time"


class _State(NamedTuple):
    """An instance at one time."""

    matrix: bytes  # to world space, float32; empty if Cycles does not blur the transform
    shape: tuple[int, int] | None  # number of vertices, and a digest of their positions; None if Cycles does not blur the shape


def of_motion(depsgraph: bpy.types.Depsgraph, frame_set: FrameSet) -> Iterator[Loss]:
    """A loss for the camera and each object whose place or shape differs when the shutter opens or closes.

    Afterwards the depsgraph is at its frame again, but references to its data from before are invalid.
    """
    scene = depsgraph.scene
    if not (scene.render.use_motion_blur and depsgraph.view_layer.use_motion_blur):
        return
    frame = scene.frame_current + scene.frame_subframe
    now = {key: state for key, _, state in _states(depsgraph)}
    moved: dict[Loss, None] = {}
    for time in _shutter(scene.render, frame):
        frame_set(*_split(time))
        moved.update((Loss(name, "", _DETAIL), None) for key, name, then in _states(depsgraph) if key in now and _moves(now[key], then))
    frame_set(*_split(frame))
    yield from moved


def _split(time: float) -> tuple[int, float]:
    frame = int(np.floor(time))
    return frame, time - frame


def _shutter(render: bpy.types.RenderSettings, frame: float) -> tuple[float, float]:
    """The times at which the shutter opens and closes, in frames."""
    before = {"START": 0.0, "CENTER": 0.5, "END": 1.0}[render.motion_blur_position]
    opens = frame - before * render.motion_blur_shutter
    return opens, opens + render.motion_blur_shutter


def _moves(a: _State, b: _State) -> bool:
    if a.matrix and b.matrix and a.matrix != b.matrix:
        before, after = np.frombuffer(a.matrix, np.float32), np.frombuffer(b.matrix, np.float32)
        if np.abs(before - after).max() > _STILL * max(np.abs(before).max(), 1.0):
            return True
    # If the number of vertices changes, Cycles blurs nothing.
    return a.shape is not None and b.shape is not None and a.shape[0] == b.shape[0] and a.shape != b.shape


def _states(depsgraph: bpy.types.Depsgraph) -> Iterator[tuple[bytes, str, _State]]:
    """The camera and all instances of meshes that render: key, which is the same at all times, name and state."""
    camera, shapes = depsgraph.scene.camera.evaluated_get(depsgraph), {}
    yield b"", camera.name, _State(_camera(camera), None)
    for instance in depsgraph.object_instances:
        thing = instance.object
        if instance.show_self and isinstance(thing.data, bpy.types.Mesh) and visibility(instance, depsgraph.view_layer):
            matrix = np.array(instance.matrix_world, np.float32).tobytes() if _blurs(instance, "use_motion_blur") else b""
            shape = _shape(thing, shapes) if matrix and _blurs(instance, "use_deform_motion") else None
            yield _key(instance), thing.name, _State(matrix, shape)


def _key(instance: bpy.types.DepsgraphObjectInstance) -> bytes:
    """A small key. It uses `name_full`, because objects from different files may have the same name."""
    parent = instance.parent.name_full if instance.is_instance else ""
    return "\0".join((instance.object.name_full, parent, "")).encode() + array("i", instance.persistent_id).tobytes()


def _camera(thing: bpy.types.Object) -> bytes:
    return np.append(np.array(thing.matrix_world), thing.data.lens).astype(np.float32).tobytes()


def _blurs(instance: bpy.types.DepsgraphObjectInstance, switch: str) -> bool:
    """Whether Cycles' switch is on at the object, and at its instancer if there is one."""
    owners = (instance.object, instance.parent) if instance.is_instance else (instance.object,)
    return all(getattr(owner.cycles, switch) for owner in owners if hasattr(owner, "cycles"))


def _shape(thing: bpy.types.Object, known: dict[int, tuple[int, int] | None]) -> tuple[int, int] | None:
    """`_State.shape`; None if a mesh cannot be read: `Collector` lists it."""
    key = thing.data.as_pointer()
    if key not in known:
        known[key] = None
        with suppress(*UNREADABLE), evaluated_mesh(thing) as mesh:
            known[key] = len(mesh.vertices), hash(read_array(mesh.vertices, "co", (3,), np.float32).tobytes())
    return known[key]
