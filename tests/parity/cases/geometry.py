"""Objects that give triangles, the front side of triangles, and the rays that see them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .registry import case, each

if TYPE_CHECKING:
    from ..stage import Stage


def lit(s: Stage) -> None:
    """A floor, in light that shows shapes."""
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.lights()


@each({"smooth": True, "flat": False})
def coarse_ball(s: Stage, smooth: bool) -> None:
    lit(s)
    ball = s.ball(s.diffuse((0.8, 0.35, 0.12)), at=(0.0, 0.0, 1.2), segments=12)
    if not smooth:
        ball.data.shade_flat()


@each({"diffuse": ("BsdfDiffuse", {}), "glossy": ("BsdfAnisotropic", {"Roughness": 0.2})})
def custom_normals(s: Stage, shader: tuple[str, dict[str, float]]) -> None:
    lit(s)
    box = s.box(s.material(shader[0], shader[1]), at=(0.0, 0.0, 0.9))
    corners = np.array([box.data.vertices[loop.vertex_index].co for loop in box.data.loops])
    flat = np.array([normal.vector for normal in box.data.corner_normals])
    box.data.normals_split_custom_set((flat + 0.5 * corners).tolist())


@case()
def in_edit_mode(s: Stage) -> None:
    """Modifiers that are on in edit mode, one that is off, and a mesh without faces."""
    lit(s)
    ball, box = s.ball(s.diffuse((0.8, 0.35, 0.12)), segments=8), s.box(s.diffuse((0.15, 0.35, 0.75)))
    ball.modifiers.new("Subdivision", "SUBSURF").show_in_editmode = False
    box.modifiers.new("Bevel", "BEVEL").width = 0.3
    edges = s.data.meshes.new("Edges")
    edges.from_pydata([(-1.0, 0.0, 2.0), (1.0, 0.0, 2.0)], [(0, 1)], [])
    s.place("Edges", edges)
    s.edit(ball, box)


@case()
def sharp_edges(s: Stage) -> None:
    lit(s)
    ball = s.ball(s.diffuse((0.8, 0.35, 0.12)))
    for edge in ball.data.edges:
        edge.use_edge_sharp = edge.index % 5 == 0


@each({"x": (-1.0, 1.2, 0.8), "all": (-0.9, -0.9, -0.9)})
def mirrored(s: Stage, scale: tuple[float, float, float]) -> None:
    lit(s)
    s.ball(s.material("BsdfGlass", {"Roughness": 0.1}), scale=scale)
    s.box(s.diffuse((0.15, 0.35, 0.75)), scale=scale)


@case()
def collection_instances(s: Stage) -> None:
    lit(s)
    collection = s.data.collections.new("Parts")
    for thing in (s.ball(s.diffuse((0.8, 0.35, 0.12))), s.box(s.material("BsdfGlossy", {"Roughness": 0.3}))):
        s.scene.collection.objects.unlink(thing)
        collection.objects.link(thing)
    for x in (-1.5, 0.0, 1.5):
        s.place("Instance", None, (x, 0.5 * x, 0.0), instance_type="COLLECTION", instance_collection=collection, scale=(0.5, 0.5, 0.4))


@case()
def instances_on_vertices(s: Stage) -> None:
    lit(s)
    floor = s.floor(None, size=2.4, location=(0.0, 0.0, 0.4), instance_type="VERTS", show_instancer_for_render=False)
    s.ball(s.diffuse((0.8, 0.35, 0.12)), at=(0.0, 0.0, 0.0), scale=(0.4, 0.4, 0.4), parent=floor)


@case()
def many_instances(s: Stage) -> None:
    """Instances with too many triangles for copies: turned like the faces that they are on, stretched, mirrored and smooth."""
    lit(s)
    ground = s.ball(
        None, at=(0.0, 0.0, 1.3), segments=16, instance_type="FACES", show_instancer_for_render=False, use_instance_faces_scale=True
    )
    material, nodes = s.nodes()
    noise = nodes.add("TexNoise", {"Vector": (nodes.add("TexCoord"), "Generated"), "Scale": 3.0})
    colour = nodes.add("MixRGB", {"Fac": (nodes.add("ObjectInfo"), "Random"), "Color1": noise, "Color2": (0.2, 0.4, 0.8)})
    nodes.surface(nodes.add("BsdfDiffuse", {"Color": colour}))
    s.ball(material, at=(0.0, 0.0, 0.0), segments=128, scale=(1.2, 0.7, -0.5), parent=ground)


@case()
def text(s: Stage) -> None:
    lit(s)
    data = s.data.curves.new("Text", "FONT")
    data.body, data.extrude, data.size, data.align_x = "RL", 0.2, 2.2, "CENTER"
    data.materials.append(s.diffuse((0.8, 0.35, 0.12)))
    s.place("Text", data, (0.0, 0.0, 0.2), rotation_euler=(1.2, 0.0, 0.2))


@case()
def curve(s: Stage) -> None:
    lit(s)
    data = s.data.curves.new("Curve", "CURVE")
    data.dimensions, data.bevel_depth = "3D", 0.25
    spline = data.splines.new("POLY")
    spline.points.add(3)
    for point, x in zip(spline.points, (-1.6, -0.6, 0.5, 1.6), strict=True):
        point.co = (x, 0.3 * x * x, 0.5 + 0.7 * abs(x), 1.0)
    data.materials.append(s.diffuse((0.8, 0.35, 0.12)))
    s.place("Curve", data)


@case()
def metaballs(s: Stage) -> None:
    lit(s)
    data = s.data.metaballs.new("Meta")
    data.render_resolution = 0.15
    for x in (-0.7, 0.5):
        data.elements.new().co = (x, 0.0, 1.0)
    data.materials.append(s.diffuse((0.8, 0.35, 0.12)))
    s.place("Meta", data)


@case()
def subdivision(s: Stage) -> None:
    lit(s)
    modifier = s.box(s.diffuse((0.8, 0.35, 0.12)), at=(0.0, 0.0, 0.9)).modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 3


@case()
def materials_of_slots_and_objects(s: Stage) -> None:
    lit(s)
    box = s.box(s.diffuse((0.8, 0.35, 0.12)), at=(0.0, 0.0, 0.9))
    box.data.materials.append(s.diffuse((0.2, 0.7, 0.3)))
    for polygon in box.data.polygons:
        polygon.material_index = polygon.index % 2
    box.material_slots[0].link = "OBJECT"
    box.material_slots[0].material = s.material("BsdfGlossy", {"Roughness": 0.3})


@case()
def hidden_things(s: Stage) -> None:
    lit(s)
    s.ball(s.diffuse((0.8, 0.35, 0.12))).hide_render = True
    s.box(s.diffuse((0.15, 0.35, 0.75))).hide_viewport = True


SWITCHES = {kind: f"visible_{kind}" for kind in ("camera", "diffuse", "glossy", "transmission", "shadow")}


@each(SWITCHES)
def hidden_from(s: Stage, switch: str) -> None:
    """An emitting ball on a diffuse floor, between a mirror behind and a pane of frosted glass."""
    lit(s)
    s.floor(s.material("BsdfGlossy", {"Roughness": 0.0}), size=4.0, location=(0.0, 2.0, 1.0), rotation_euler=(1.5, 0.0, 0.2))
    s.box(s.material("BsdfRefraction", {"Roughness": 0.3, "IOR": 1.2}, distribution="GGX"), at=(0.9, -1.2, 0.7), scale=(0.8, 0.8, 0.8))
    ball = s.ball(
        s.material("BsdfPrincipled", {"Base Color": (0.7, 0.7, 0.7), "Emission Color": (1.0, 0.4, 0.1), "Emission Strength": 1.0})
    )
    setattr(ball, switch, False)


@each(SWITCHES)
def emitter_hidden_from(s: Stage, switch: str) -> None:
    """Nothing is translucent: at such surfaces Cycles uses different kinds of rays for sampling an emitter and for hitting it."""
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(s.material("BsdfGlossy", {"Roughness": 0.2}))
    s.box(s.material("BsdfRefraction", {"Color": (0.6, 0.7, 0.8), "Roughness": 0.5, "IOR": 1.1}, distribution="GGX"))
    s.sky((0.2, 0.25, 0.3))
    emitter = s.floor(s.glow((1.0, 0.8, 0.6), 2.0), size=3.0, location=(0.4, -1.8, 3.0), rotation_euler=(0.6, 2.8, 0.0))
    setattr(emitter, switch, False)


@case()
def indirect_only(s: Stage) -> None:
    lit(s)
    collection = s.data.collections.new("Indirect")
    s.scene.collection.children.link(collection)
    ball = s.ball(s.glow((1.0, 0.5, 0.2), 2.0))
    s.scene.collection.objects.unlink(ball)
    collection.objects.link(ball)
    s.scene.view_layers[0].layer_collection.children["Indirect"].indirect_only = True


@case()
def triangles_without_area(s: Stage) -> None:
    lit(s)
    s.ball(s.diffuse((0.8, 0.35, 0.12)))
    flat = s.floor(s.diffuse((0.8, 0.8, 0.8)), size=1.0)
    for vertex in flat.data.vertices:
        vertex.co.x = 0.0
