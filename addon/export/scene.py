"""Exports a depsgraph: builds a scene from the results of the other files of this folder."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import SHADOW, Loss, Shader
from blender_rl_guiding.scene.faults import fault_of_shader, find_fault, find_nothing
from blender_rl_guiding.strings import fit

from . import coverage
from .camera import read_camera
from .collector import Collector
from .film import read_bounces, read_film
from .instances import worth_instancing
from .motion import FrameSet, of_motion
from .resources import Resources
from .stop import Stop, Stopped, never
from .text import shown
from .world import read_world, world_visibility


def export(depsgraph: bpy.types.Depsgraph, frame_set: FrameSet, stop: Stop = never) -> SceneData:
    """The scene of a depsgraph in render mode. InputError if it cannot be rendered.

    `frame_set`: the method of the engine that renders the depsgraph.
    `stop`: called before each instance, and during waits for another Blender; raises Stopped where it returns True.
    """
    scene = depsgraph.scene
    name = Path(bpy.data.filepath).name or scene.name
    try:
        data = _export(depsgraph, fit(Path(name).stem), frame_set, stop)
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
    if fault := find_fault(data):
        raise InputError(f"{name}: {fault}")
    if nothing := find_nothing(data):
        return replace(data, coverage=(*data.coverage, Loss(scene.name, "", nothing)))
    return data


def _export(depsgraph: bpy.types.Depsgraph, name: str, frame_set: FrameSet, stop: Stop) -> SceneData:
    scene = depsgraph.scene
    collector = Collector(depsgraph, read_camera(depsgraph, whole=True)[0], worth_instancing(_instances(depsgraph, stop)), stop)
    camera, camera_losses = read_camera(depsgraph)
    world, world_losses = _world(scene, collector.resources)
    for instance in _instances(depsgraph, stop):
        collector.add(instance)
    collector.note((*collector.custom.losses, *of_motion(depsgraph, frame_set)))
    losses = (
        *coverage.of_scene(scene, depsgraph.view_layer),
        *coverage.of_shaders(scene, collector.shaders),
        *coverage.of_links(depsgraph),
        *camera_losses,
        *world_losses,
        *collector.losses,
    )
    return SceneData(
        name=name,
        **collector.arrays(),
        shaders=tuple(collector.shaders),
        camera=camera,
        world=world,
        world_visibility=world_visibility(scene.world),
        lamps=tuple(collector.lamps),
        film=read_film(scene),
        bounces=read_bounces(scene),
        tables=collector.resources.tables,
        textures=tuple(collector.resources.textures),
        coverage=tuple(map(shown, losses)),
    )


def _instances(depsgraph: bpy.types.Depsgraph, stop: Stop) -> Iterator[bpy.types.DepsgraphObjectInstance]:
    for instance in depsgraph.object_instances:
        if stop():
            raise Stopped
        yield instance


def _world(scene: bpy.types.Scene, resources: Resources) -> tuple[Shader, list[Loss]]:
    """As `read_world`. If a number is not finite, the world is black. If no ray sees the world, there are no losses."""
    shader, losses = read_world(scene.world, resources, scene.frame_current_final)
    if fault := fault_of_shader(shader):
        shader, losses = Shader(shader.name), [*losses, Loss(shader.name, "", f"black stands in: {fault}")]
    return shader, losses if world_visibility(scene.world) & ~SHADOW else []
