"""Building blocks of the slides' scenes: walls, spheres, lights, a camera, and Cycles' settings for a fair comparison.

Points are those of the slides: x, y up, z into the picture, left-handed. `place` swaps y and z for Blender. Units are metres.
Runs in the bpy module: python scenes/build/a1.py
"""

import math
from pathlib import Path

import bpy
import mathutils  # pyright: ignore[reportMissingImports]  # a part of bpy

NAMES = tuple(letter + digit for letter in "abc" for digit in "123")
SCENES = Path(__file__).resolve().parents[1]
Point = tuple[float, float, float]
Color = tuple[float, float, float]
WHITE, RED, BLUE = (0.75, 0.75, 0.75), (0.75, 0.25, 0.25), (0.25, 0.25, 0.75)


def place(point: Point) -> mathutils.Vector:
    """A point of the slides in Blender's axes."""
    x, y, z = point
    return mathutils.Vector((x, z, y))


def start(name: str, resolution: int, max_bounces: int) -> None:
    """An empty scene with a black world, square pixels and unbiased Cycles."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.name = name
    scene.world = bpy.data.worlds.new("Black")
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
    render = scene.render
    render.engine = "CYCLES"
    render.resolution_x = render.resolution_y = resolution
    render.filepath = "//"
    scene.view_settings.view_transform = "Standard"
    _set_up_cycles(scene.cycles, max_bounces)


def _set_up_cycles(cycles: bpy.types.bpy_struct, max_bounces: int) -> None:
    """Switch off whatever makes Cycles' image differ from the integral."""
    cycles.samples = 1024
    cycles.pixel_filter_type = "BOX"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.min_light_bounces = 1024  # no Russian roulette: its noise is not part of the comparison
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = cycles.light_sampling_threshold = 0.0
    for kind in ("max", "diffuse", "glossy", "transmission"):
        setattr(cycles, f"{kind}_bounces", max_bounces)


def diffuse(name: str, color: Color) -> bpy.types.Material:
    """A Lambertian material of the given albedo."""
    return _material(name, "ShaderNodeBsdfDiffuse", "BSDF", color)


def emitter(name: str, radiance: float) -> bpy.types.Material:
    """A white light that reflects nothing."""
    return _material(name, "ShaderNodeEmission", "Emission", (1, 1, 1), Strength=radiance)


def _material(name: str, node: str, output: str, color: Color, **inputs: float) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new(node)
    for socket, value in ({"Color": (*color, 1)} | inputs).items():
        shader.inputs[socket].default_value = value
    tree.links.new(shader.outputs[output], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def _link(name: str, mesh: bpy.types.Mesh, material: bpy.types.Material) -> bpy.types.Object:
    """An object of the mesh. The object has the material, so objects can share one mesh."""
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(thing)
    thing.material_slots[0].link = "OBJECT"
    thing.material_slots[0].material = material
    return thing


def quad(name: str, low: Point, high: Point, facing: Point, material: bpy.types.Material) -> None:
    """A rectangle between two opposite corners, which agree in one coordinate. Its front faces the point `facing`."""
    axis = next(i for i in range(3) if low[i] == high[i])
    u = (axis + 1) % 3
    corners = [list(low), list(low), list(high), list(high)]
    corners[1][u], corners[3][u] = high[u], low[u]
    points = [place((x, y, z)) for x, y, z in corners]
    if (points[1] - points[0]).cross(points[2] - points[0]).dot(place(facing) - points[0]) < 0:
        points.reverse()
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], [(0, 1, 2, 3)])
    mesh.materials.append(None)
    _link(name, mesh, material)


def room(low: Point, high: Point, front: bool = True, floor: Color = WHITE) -> None:
    """A box seen from inside, red to the left, blue to the right. `front=False`: open towards the camera."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    middle = ((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2)
    white = diffuse("White", WHITE)
    quad("Left", low, (x0, y1, z1), middle, diffuse("Red", RED))
    quad("Right", (x1, y0, z0), high, middle, diffuse("Blue", BLUE))
    quad("Floor", low, (x1, y0, z1), middle, white if floor == WHITE else diffuse("Floor", floor))
    quad("Ceiling", (x0, y1, z0), high, middle, white)
    if front:
        quad("Front", low, (x1, y1, z0), middle, white)
    quad("Back", (x0, y0, z1), high, middle, white)


def block(name: str, low: Point, high: Point, color: Color, **sides: Color) -> None:
    """A box seen from outside, without a bottom. `sides`: other colours for left, right, top, front, back."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    far = 1e3
    faces = {
        "left": (low, (x0, y1, z1), (-far, y0, z0)),
        "right": ((x1, y0, z0), high, (far, y0, z0)),
        "top": ((x0, y1, z0), high, (x0, far, z0)),
        "front": (low, (x1, y1, z0), (x0, y0, -far)),
        "back": ((x0, y0, z1), high, (x0, y0, far)),
    }
    plain = diffuse(name, color)
    for side, (a, b, facing) in faces.items():
        quad(f"{name} {side}", a, b, facing, diffuse(f"{name} {side}", sides[side]) if side in sides else plain)


def light(low: Point, high: Point, facing: Point, radiance: float) -> None:
    """A light that shines towards `facing` alone. Cycles' emitters shine to both sides, so a black sheet of the same size lies behind."""
    quad("Light", low, high, facing, emitter("Light", radiance))
    axis = next(i for i in range(3) if low[i] == high[i])
    behind = math.copysign(1.0, low[axis] - facing[axis])
    gap, far = 0.0005 * behind, 1e3 * behind
    quad("Back of light", _moved(low, axis, gap), _moved(high, axis, gap), _moved(low, axis, far), diffuse("Black", (0, 0, 0)))


def _moved(point: Point, axis: int, distance: float) -> Point:
    moved = list(point)
    moved[axis] += distance
    return moved[0], moved[1], moved[2]


def sphere(name: str, centre: Point, radius: float, color: Color) -> None:
    """A smooth sphere of 128 x 64 faces. All spheres of a scene share one mesh."""
    mesh = bpy.data.meshes.get("Sphere") or _sphere_mesh()
    thing = _link(name, mesh, diffuse(name, color))
    thing.location = place(centre)
    thing.scale = (radius, radius, radius)


def _sphere_mesh(segments: int = 128, rings: int = 64) -> bpy.types.Mesh:
    """Radius 1, poles up and down. Made here, because Blender's operator numbers faces differently each time."""
    rows, columns = range(1, rings), range(segments)
    points = [_on_sphere(math.pi * i / rings, math.tau * j / segments) for i in rows for j in columns]
    top, bottom = len(points), len(points) + 1

    def at(i: int, j: int) -> int:
        return (i - 1) * segments + j % segments

    faces = [(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)) for i in rows[:-1] for j in columns]
    faces += [(top, at(1, j), at(1, j + 1)) for j in columns]
    faces += [(bottom, at(rings - 1, j + 1), at(rings - 1, j)) for j in columns]
    mesh = bpy.data.meshes.new("Sphere")
    mesh.from_pydata([*points, (0, 0, 1), (0, 0, -1)], [], faces)
    mesh.shade_smooth()
    mesh.materials.append(None)
    return mesh


def _on_sphere(theta: float, phi: float) -> Point:
    return math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)


def camera(eye: Point, target: Point, vfov: float) -> None:
    """A pinhole camera with a vertical field of view in degrees."""
    data = bpy.data.cameras.new("Camera")
    data.sensor_fit = "VERTICAL"
    data.lens = data.sensor_height / 2 / math.tan(math.radians(vfov) / 2)
    thing = bpy.data.objects.new("Camera", data)
    bpy.context.scene.collection.objects.link(thing)
    thing.location = place(eye)
    thing.rotation_euler = (place(target) - place(eye)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.camera = thing


def finish() -> None:
    """Write scenes/NAME.blend, then a preview by Cycles beside it."""
    save()
    scene = bpy.context.scene
    scene.render.use_stamp_filename = scene.render.use_stamp_date = scene.render.use_stamp_render_time = False
    scene.cycles.samples, scene.cycles.use_denoising = 64, True
    scene.render.filepath = str(SCENES / f"{scene.name}.png")
    bpy.ops.render.render(write_still=True)


def save() -> None:
    """Write scenes/NAME.blend."""
    scene = bpy.context.scene
    for browser in (space for screen in bpy.data.screens for area in screen.areas for space in area.spaces if space.type == "FILE_BROWSER"):
        if browser.params:
            browser.params.directory = b""  # the builder's home folder
    bpy.context.preferences.filepaths.save_version = 0  # no .blend1
    bpy.ops.wm.save_as_mainfile(filepath=str(SCENES / f"{scene.name}.blend"), compress=True)
