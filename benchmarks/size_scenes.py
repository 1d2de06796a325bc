"""Scenes of any size: rooms and forests as .blend files, and a floor below any number of lights."""

import math
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import Bounces, Camera, Closure, Lamp, Shader

WALLS = 6
QUADS = 25_000  # leaves of a tree
HALF = 0.02  # half the edge of an emitting quad, and radius of a ball, in metres


def write_room(path: Path, cuts: int, pixels: int) -> None:
    """Write a closed room as a .blend: six smooth, displaced walls, half of them with a UV texture.

    The displacement is 0 at the edges of walls, so no ray escapes.
    """
    bpy = import_module("bpy")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    materials = [_material(bpy, "plain", checked=False), _material(bpy, "checked", checked=True)]
    for wall in range(WALLS):
        thing = bpy.data.objects.new(f"wall {wall}", _wall(bpy, cuts, wall, materials[wall % 2]))
        thing.matrix_world = _wall_matrix(wall).T
        bpy.context.collection.objects.link(thing)
    _lamp_and_camera(bpy, pixels)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)


def write_forest(path: Path, trees: int, pixels: int) -> None:
    """Write a .blend: linked duplicates of a tree of 50,000 triangles, under a grey sky."""
    bpy = import_module("bpy")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    rng = np.random.default_rng(1)
    leaves = rng.normal(size=(QUADS, 1, 3)) * (0.5, 0.5, 1) + (0, 0, 2) + rng.normal(size=(QUADS, 4, 3)) * 0.03
    mesh = bpy.data.meshes.new("tree")
    mesh.from_pydata(leaves.reshape(-1, 3), [], np.arange(4 * QUADS).reshape(-1, 4))
    mesh.materials.append(_material(bpy, "leaf", checked=False))
    for place in rng.uniform((-12, 0, 0, -3), (12, 40, 0, 3), (trees, 4)):
        thing = bpy.data.objects.new("tree", mesh)
        thing.location, thing.rotation_euler[2] = place[:3], place[3]
        bpy.context.collection.objects.link(thing)
    _lamp_and_camera(bpy, pixels)
    bpy.context.scene.camera.location = (0.0, -12.0, 5.0)
    bpy.context.scene.world = bpy.data.worlds.new("sky")
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)


def _wall(bpy: Any, cuts: int, seed: int, material: Any) -> Any:
    """A grid over -1..1, displaced by waves and by noise."""
    line = np.linspace(-1, 1, cuts + 1)
    x, y = (a.ravel() for a in np.meshgrid(line, line))
    rough = np.random.default_rng(seed).standard_normal(len(x)) * 0.2 / cuts
    z = (1 - x * x) * (1 - y * y) * (0.1 * np.sin(5 * x + seed) * np.sin(7 * y) + rough)
    low = (np.arange(cuts)[:, None] * (cuts + 1) + np.arange(cuts)).ravel()
    corners = np.stack([low, low + 1, low + cuts + 2, low + cuts + 1], axis=1).astype(np.int32)
    mesh = bpy.data.meshes.new(f"wall {seed}")
    mesh.vertices.add(len(x))
    mesh.loops.add(corners.size)
    mesh.polygons.add(len(corners))
    mesh.vertices.foreach_set("co", np.stack([x, y, z], axis=1).astype(np.float32).ravel())
    mesh.loops.foreach_set("vertex_index", corners.ravel())
    mesh.polygons.foreach_set("loop_start", np.arange(0, corners.size, 4, dtype=np.int32))
    mesh.update(calc_edges=True)
    uv = np.stack([x, y], axis=1).astype(np.float32)[corners.ravel()]
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", uv.ravel())
    mesh.shade_smooth()
    mesh.materials.append(material)
    return mesh


def _wall_matrix(wall: int) -> np.ndarray:
    """The matrix of a wall. Its upper side faces the middle of the room."""
    axis, side = divmod(wall, 2)
    matrix = np.zeros((4, 4))
    inwards = 1.0 - 2.0 * side
    matrix[axis, 2], matrix[axis, 3], matrix[3, 3] = inwards, -inwards, 1.0
    matrix[(axis + 1) % 3, 0], matrix[(axis + 2) % 3, 1] = inwards, 1.0
    return matrix


def _material(bpy: Any, name: str, *, checked: bool) -> Any:
    material = bpy.data.materials.new(name)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    shader, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    links.new(shader.outputs[0], output.inputs["Surface"])
    if checked:
        checker, coordinates = nodes.new("ShaderNodeTexChecker"), nodes.new("ShaderNodeTexCoord")
        links.new(coordinates.outputs["UV"], checker.inputs["Vector"])
        links.new(checker.outputs["Color"], shader.inputs["Color"])
    return material


def _lamp_and_camera(bpy: Any, pixels: int) -> None:
    scene = bpy.context.scene
    lamp, data = bpy.data.lights.new("lamp", "AREA"), bpy.data.cameras.new("camera")
    lamp.energy, lamp.size, data.angle = 20.0, 0.4, math.radians(80)
    camera = bpy.data.objects.new("camera", data)
    camera.location, camera.rotation_euler = (0.0, -0.8, 0.0), (math.pi / 2, 0.0, 0.0)
    light = bpy.data.objects.new("lamp", lamp)
    light.location = (0.0, 0.0, 0.7)
    for thing in (camera, light):
        scene.collection.objects.link(thing)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = pixels


# ----------------------------------------------------------------------------------------------------------- many lights


def lit_floor(emitters: int, pixels: int, kind: str) -> SceneData:
    """A floor below a square of emitters with unequal power. `kind`: "quads" that emit, or lamps, "points" or "balls".

    Each power is an exponential variate cubed: a few are bright, most are dim. They add up to 100.
    """
    rng = np.random.default_rng(7)
    power = rng.exponential(size=emitters) ** 3
    power *= 100 / power.sum()
    places = np.column_stack([rng.uniform(-4, 4, (emitters, 2)), np.full(emitters, 1.0)])
    shaders = [Shader("floor", (), (Closure("diffuse", 1.0, {"color": (0.8, 0.8, 0.8)}),))]
    corners, lamps = _square(np.zeros((1, 3)), 5.0, up=True), ()
    if kind == "quads":
        corners = np.concatenate([corners, _square(places, HALF, up=False)])
        radiance = power / (2 * math.pi * (2 * HALF) ** 2)  # to both sides
        shaders += [Shader(str(k), (), (Closure("emission", float(radiance[k])),)) for k in range(emitters)]
    else:
        lamps = tuple(_lamp(str(k), places[k], power[k] / (4 * math.pi), kind) for k in range(emitters))
    quads = len(corners) // 4
    normals = np.zeros((2 * quads, 3, 3), np.float32)
    normals[:2, :, 2], normals[2:, :, 2] = 1.0, -1.0
    return SceneData(
        name=f"{emitters} emitters",
        vertices=corners.astype(np.float32),
        triangles=(4 * np.arange(quads)[:, None, None] + [[0, 1, 2], [0, 2, 3]]).reshape(-1, 3).astype(np.int32),
        normals=normals,
        material=np.repeat(np.arange(quads), 2).astype(np.int32),
        object=np.zeros(2 * quads, np.int32),
        shaders=tuple(shaders),
        camera=Camera(_at(np.array([0.0, 0.0, 0.9])), (-4.0, 4.0, -4.0, 4.0), pixels, pixels),
        lamps=lamps,
        bounces=Bounces(1, 1, 1, 1),
    )


def _lamp(name: str, place: np.ndarray, intensity: float, kind: str) -> Lamp:
    return Lamp(name, "point", _at(place), (intensity, intensity, intensity), radius=HALF if kind == "balls" else 0.0)


def _square(middles: np.ndarray, half: float, *, up: bool) -> np.ndarray:
    """Corners (4 n, 3) of level squares around middles (n, 3), which face up or down."""
    around = half * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
    return (middles[:, None] + (around if up else around[::-1])).reshape(-1, 3)


def _at(place: np.ndarray) -> tuple[tuple[float, ...], ...]:
    matrix = np.eye(4)
    matrix[:3, 3] = place
    return tuple(map(tuple, matrix.tolist()))
