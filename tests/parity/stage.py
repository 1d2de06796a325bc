"""Building blocks of the parity cases: a floor, a ball, a box, lamps and node trees, made with bpy's data API."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector

Color = tuple[float, float, float]

GREY, ORANGE, BLUE = (0.6, 0.6, 0.6), (0.8, 0.35, 0.12), (0.15, 0.35, 0.75)


class Nodes:
    """Builds a node tree."""

    def __init__(self, tree: bpy.types.NodeTree, output: str) -> None:
        self.tree = tree
        tree.nodes.clear()
        self._output = tree.nodes.new(output)

    def add(self, kind: str, inputs: Mapping[str, Any] | None = None, **attributes: Any) -> bpy.types.Node:
        """A node of type ShaderNode`kind`.

        inputs: values by the identifier of a socket, or else by its name. For the values see `set_input`.
        """
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in attributes.items():
            setattr(node, name, value)
        for name, value in (inputs or {}).items():
            self.set_input(_socket(node.inputs, name), value)
        return node

    def set_input(self, socket: bpy.types.NodeSocket, value: Any) -> None:
        """Set or link an input. value: a number, three numbers, a node (for its first enabled output), or (node, name of an output)."""
        if isinstance(value, bpy.types.Node):
            value = value, next(output.identifier for output in value.outputs if output.enabled)
        if isinstance(value, tuple) and isinstance(value[0], bpy.types.Node):
            self.tree.links.new(_socket(value[0].outputs, value[1]), socket)
        elif socket.type == "RGBA":
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value

    def surface(self, shader: Any) -> None:
        """Link a shader to the output."""
        self.set_input(self._output.inputs["Surface"], shader)


def _socket(sockets: Any, name: str) -> bpy.types.NodeSocket:
    by_identifier = [socket for socket in sockets if socket.identifier == name]
    return by_identifier[0] if by_identifier else next(socket for socket in sockets if socket.name == name and socket.enabled)


class Stage:
    """An empty scene. The camera looks at the origin from the front; Cycles' settings have no bias."""

    def __init__(self) -> None:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)  # quick: it does not reload the add-ons
        self.data = bpy.data
        self.scene = bpy.context.scene
        self.scene.world = bpy.data.worlds.new("World")
        self.sky((0.0, 0.0, 0.0))
        self.camera = self.place("Camera", bpy.data.cameras.new("Camera"), (0.0, -6.0, 3.0))
        self.aim(self.camera, (0.0, 0.0, 0.7))
        self.scene.camera = self.camera
        self.size(24, 24)
        _without_bias(self.scene)

    def size(self, width: int, height: int) -> None:
        """Pixels of the image."""
        self.scene.render.resolution_x, self.scene.render.resolution_y = width, height

    # --- things ------------------------------------------------------------------------------------------------------

    def place(self, name: str, data: Any, at: Color = (0.0, 0.0, 0.0), **attributes: Any) -> bpy.types.Object:
        """An object in the scene."""
        thing = bpy.data.objects.new(name, data)
        thing.location = at
        for attribute, value in attributes.items():
            setattr(thing, attribute, value)
        self.scene.collection.objects.link(thing)
        return thing

    def aim(self, thing: bpy.types.Object, at: Color) -> None:
        """Turn an object: -z points to `target`, y is up."""
        thing.rotation_euler = (Vector(at) - thing.location).to_track_quat("-Z", "Y").to_euler()

    def edit(self, *things: bpy.types.Object) -> None:
        """Leave objects in edit mode."""
        for thing in things:
            thing.select_set(True)
        bpy.context.view_layer.objects.active = things[0]
        bpy.ops.object.mode_set(mode="EDIT")

    def floor(self, material: bpy.types.Material | None = None, size: float = 8.0, **attributes: Any) -> bpy.types.Object:
        """A square in the plane z = 0."""
        return self.place("Floor", mesh(bmesh.ops.create_grid, material, x_segments=1, y_segments=1, size=size / 2), **attributes)

    def ball(
        self, material: bpy.types.Material | None = None, at: Color = (-0.9, 0.0, 1.05), segments: int = 48, **attributes: Any
    ) -> bpy.types.Object:
        """A smooth ball of radius 1, a little above the floor."""
        data = mesh(bmesh.ops.create_uvsphere, material, u_segments=segments, v_segments=segments // 2, radius=1.0)
        data.shade_smooth()
        return self.place("Ball", data, at, **attributes)

    def box(self, material: bpy.types.Material | None = None, at: Color = (1.3, 0.2, 0.75), **attributes: Any) -> bpy.types.Object:
        """A cube of edge 1.4, turned a little. It does not touch the floor, because surfaces in the same place have no order."""
        data = mesh(bmesh.ops.create_cube, material, size=1.4)
        return self.place("Box", data, at, **({"rotation_euler": (0.0, 0.0, 0.5)} | attributes))

    def set(self, paint: Callable[[Color], bpy.types.Material] | None = None) -> tuple[bpy.types.Object, ...]:
        """Floor, ball and box, each with its own colour. `paint` makes the materials; by default they are diffuse."""
        paint = paint or self.diffuse
        return self.floor(paint(GREY)), self.ball(paint(ORANGE)), self.box(paint(BLUE))

    # --- light -------------------------------------------------------------------------------------------------------

    def lamp(self, kind: str, at: Color = (1.5, -2.0, 3.5), power: float = 300.0, **attributes: Any) -> bpy.types.Object:
        """A lamp that points at the middle of the set. attributes: of the light."""
        light = bpy.data.lights.new("Lamp", kind)
        light.energy = power
        for name, value in attributes.items():
            setattr(light, name, value)
        thing = self.place("Lamp", light, at)
        self.aim(thing, (0.0, 0.0, 0.5))
        return thing

    def lights(self) -> None:
        """A very large lamp and a sky, which give little noise on every surface, even in caustics."""
        self.lamp("AREA", (2.0, -2.5, 4.5), 500.0, size=5.0)
        self.sky((0.3, 0.4, 0.55))

    def sky(self, color: Any, strength: float = 1.0) -> Nodes:
        """The world's background. Returns its nodes, so that a case can link the colour."""
        nodes = Nodes(self.scene.world.node_tree, "ShaderNodeOutputWorld")
        nodes.surface(nodes.add("Background", {"Color": color, "Strength": strength}))
        return nodes

    # --- materials ---------------------------------------------------------------------------------------------------

    def nodes(self) -> tuple[bpy.types.Material, Nodes]:
        """A new material and its empty tree."""
        material = bpy.data.materials.new("Material")
        return material, Nodes(material.node_tree, "ShaderNodeOutputMaterial")

    def material(self, kind: str, inputs: Mapping[str, Any], **attributes: Any) -> bpy.types.Material:
        """A material: one shader node with constant inputs."""
        material, nodes = self.nodes()
        nodes.surface(nodes.add(kind, inputs, **attributes))
        return material

    def diffuse(self, color: Color) -> bpy.types.Material:
        """A Diffuse BSDF."""
        return self.material("BsdfDiffuse", {"Color": color})

    def glow(self, color: Color, strength: float = 1.0) -> bpy.types.Material:
        """An Emission shader."""
        return self.material("Emission", {"Color": color, "Strength": strength})

    def subject(self, kind: str, inputs: Mapping[str, Any], **attributes: Any) -> None:
        """Ball and box of one shader on a diffuse floor, brightly lit."""
        self.lights()
        self.floor(self.diffuse(GREY))
        material = self.material(kind, inputs, **attributes)
        self.ball(material)
        self.box(material)

    def chart(self, paint: Callable[[Nodes], Any]) -> tuple[bpy.types.Object, ...]:
        """Floor, ball and box that emit the colour of `paint`: the image shows it without noise."""
        material, nodes = self.nodes()
        nodes.surface(nodes.add("Emission", {"Color": paint(nodes)}))
        return self.floor(material), self.ball(material), self.box(material)

    def image(self, width: int = 8, height: int = 6, colorspace: str = "sRGB", **options: Any) -> bpy.types.Image:
        """A packed image of random texels. With `alpha=True`, alpha is random too."""
        image = bpy.data.images.new("Image", width, height, **options)
        image.colorspace_settings.name = colorspace
        texels = np.random.default_rng(7).random((height * width, 4), np.float32)
        texels[:, 3] = 0.5 + 0.5 * texels[:, 3] if options.get("alpha") else 1.0  # at least 0.5: Cycles divides by alpha
        image.pixels.foreach_set(texels.ravel())
        image.pack()
        return image


def mesh(make: Callable[..., Any], material: bpy.types.Material | None, **options: Any) -> bpy.types.Mesh:
    """A mesh by one of bmesh's operators, with a UV map."""
    shape = bmesh.new()
    shape.loops.layers.uv.new("UVMap")
    make(shape, calc_uvs=True, matrix=Matrix(), **options)
    data = bpy.data.meshes.new("Mesh")
    shape.to_mesh(data)
    shape.free()
    if material:
        data.materials.append(material)
    return data


def _without_bias(scene: bpy.types.Scene) -> None:
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.pixel_filter_type = "BOX"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = cycles.light_sampling_threshold = 0.0
    cycles.sampling_pattern = "TABULATED_SOBOL"  # pixels are independent of each other, unlike with blue noise


def degrees(angle: float) -> float:
    """Degrees in radians, Blender's unit."""
    return math.radians(angle)
