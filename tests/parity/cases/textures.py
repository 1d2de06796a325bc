"""Images, coordinates, attributes and normals, shown as emission, or on surfaces if light matters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .registry import CHART, case, each

if TYPE_CHECKING:
    from ..stage import Nodes, Stage

BEYOND = (2.7, 2.2, 1.0)  # a scale that moves coordinates beyond the image


def scaled_uv(nodes: Nodes, location: tuple[float, float, float] = (-0.7, -0.4, 0.0)) -> Any:
    """UV coordinates from below 0 to above 1."""
    return nodes.add("Mapping", {"Vector": (nodes.add("TexCoord"), "UV"), "Location": location, "Scale": BEYOND})


@each(
    {
        f"{extension.lower()}_{interpolation.lower()}": {"extension": extension, "interpolation": interpolation}
        for extension in ("REPEAT", "EXTEND", "CLIP", "MIRROR")
        for interpolation in ("Linear", "Closest")
    },
    samples=CHART,
)
def image(s: Stage, attributes: dict[str, str]) -> None:
    s.chart(lambda nodes: nodes.add("TexImage", {"Vector": scaled_uv(nodes)}, image=s.image(), **attributes))


@each(
    {
        "srgb": {"colorspace": "sRGB"},
        "non_color": {"colorspace": "Non-Color"},
        "linear_float": {"colorspace": "Linear Rec.709", "float_buffer": True},
        "non_color_float": {"colorspace": "Non-Color", "float_buffer": True},
        "srgb_float": {"colorspace": "sRGB", "float_buffer": True},
        "with_alpha": {"alpha": True},
        "with_alpha_float": {"colorspace": "Linear Rec.709", "float_buffer": True, "alpha": True},
        "with_alpha_non_color": {"colorspace": "Non-Color", "alpha": True},
        "of_1_texel": {"width": 1, "height": 1},
    },
    samples=CHART,
)
def image_as(s: Stage, options: dict[str, Any]) -> None:
    s.chart(lambda nodes: nodes.add("TexImage", image=s.image(**options)))


@each({mode.lower(): mode for mode in ("NONE", "STRAIGHT", "PREMUL", "CHANNEL_PACKED")}, samples=CHART)
def image_alpha_mode(s: Stage, mode: str) -> None:
    """The colour, with and without a link at the Alpha socket."""
    picture = s.image(alpha=True)
    picture.alpha_mode = mode

    def paint(nodes: Nodes) -> Any:
        alone, both = nodes.add("TexImage", image=picture), nodes.add("TexImage", image=picture)
        split = {"Factor_Float": (both, "Alpha"), "A_Color": alone, "B_Color": (both, "Color")}
        return nodes.add("Mix", split, data_type="RGBA")

    s.chart(paint)


@case(samples=CHART)
def image_with_faulty_texels(s: Stage) -> None:
    """Texels that are NaN or infinite, and their alpha."""
    picture = s.image(colorspace="Linear Rec.709", float_buffer=True, alpha=True)
    texels = np.empty(len(picture.pixels), np.float32)
    picture.pixels.foreach_get(texels)
    texels[[4 * 9, 4 * 20 + 1, 4 * 33 + 3]] = np.nan, np.inf, np.nan
    picture.pixels.foreach_set(texels)
    picture.pack()

    def paint(nodes: Nodes) -> Any:
        texture = nodes.add("TexImage", image=picture, interpolation="Closest")
        return nodes.add("Mix", {"Factor_Float": (texture, "Alpha"), "A_Color": (0.2, 0.3, 0.4), "B_Color": texture}, data_type="RGBA")

    s.chart(paint)


@case()
def alpha_drives_a_mix_shader(s: Stage) -> None:
    material, nodes = s.nodes()
    texture = nodes.add("TexImage", image=s.image(alpha=True), interpolation="Closest")
    clear, solid = nodes.add("BsdfTransparent"), nodes.add("BsdfDiffuse", {"Color": (texture, "Color")})
    nodes.surface(nodes.add("MixShader", {"Fac": (texture, "Alpha"), "Shader": clear, "Shader_001": solid}))
    s.lights()
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(material)
    s.box(material)


@each({"diffuse": "BsdfDiffuse", "glossy": "BsdfAnisotropic", "principled": "BsdfPrincipled"})
def image_on(s: Stage, kind: str) -> None:
    material, nodes = s.nodes()
    color = "Base Color" if kind == "BsdfPrincipled" else "Color"
    nodes.surface(nodes.add(kind, {color: nodes.add("TexImage", image=s.image())}))
    s.lights()
    s.floor(material)
    s.ball(material)
    s.box(material)


@each({"named": "Second", "for_rendering": ""}, samples=CHART)
def uv_map(s: Stage, name: str) -> None:
    def paint(nodes: Nodes) -> Any:
        return nodes.add("TexImage", {"Vector": nodes.add("UVMap", uv_map=name)}, image=s.image())

    for thing in s.chart(paint):
        layer = thing.data.uv_layers.new(name="Second")
        turned = np.array([entry.vector for entry in thing.data.uv_layers[0].uv], np.float32)[:, ::-1] * 0.8
        layer.uv.foreach_set("vector", turned.ravel())
        layer.active_render = True


@case(samples=CHART)
def without_a_uv_map(s: Stage) -> None:
    for thing in s.chart(
        lambda nodes: nodes.add("Mix", {"A_Color": nodes.add("TexImage", image=s.image()), "B_Color": (0.5, 0.2, 0.1)}, data_type="RGBA")
    ):
        thing.data.uv_layers.remove(thing.data.uv_layers[0])


@each({output.lower(): output for output in ("Generated", "Normal", "UV", "Object", "Reflection")}, samples=CHART)
def coordinates(s: Stage, output: str) -> None:
    s.chart(lambda nodes: positive(nodes, (nodes.add("TexCoord"), output)))


@case(samples=CHART)
def coordinates_of_another_object(s: Stage) -> None:
    other = s.place("Other", None, (0.3, -0.5, 0.2), rotation_euler=(0.1, 0.4, 0.2), scale=(1.2, 0.7, 1.2))
    s.chart(lambda nodes: positive(nodes, (nodes.add("TexCoord", object=other), "Object")))


@case(samples=CHART)
def generated_of_a_deformed_mesh(s: Stage) -> None:
    things = s.chart(lambda nodes: positive(nodes, (nodes.add("TexCoord"), "Generated")))
    modifier = things[2].modifiers.new("Stretch", "SIMPLE_DEFORM")
    modifier.deform_method, modifier.factor = "STRETCH", 0.5


@each(
    {output.lower().replace(" ", "_"): output for output in ("Position", "Normal", "True Normal", "Incoming", "Parametric", "Backfacing")},
    samples=CHART,
)
def geometry_node(s: Stage, output: str) -> None:
    things = s.chart(lambda nodes: positive(nodes, (nodes.add("NewGeometry"), output)))
    things[1].data.flip_normals()


@case(samples=CHART)
def geometry_tangent(s: Stage) -> None:
    s.chart(lambda nodes: positive(nodes, (nodes.add("NewGeometry"), "Tangent")))


@each({"radial_z": {"axis": "Z"}, "radial_x": {"axis": "X"}, "uv": {"direction_type": "UV_MAP"}}, samples=CHART)
def tangent_node(s: Stage, attributes: dict[str, str]) -> None:
    floor, *_ = s.chart(lambda nodes: positive(nodes, nodes.add("Tangent", **attributes)))
    s.data.objects.remove(floor)  # a floor has no thickness, so its radius around the x axis is 0


@case()
def tangent_of_an_anisotropic_surface(s: Stage) -> None:
    material, nodes = s.nodes()
    tangent = nodes.add("Tangent", direction_type="UV_MAP")
    nodes.surface(nodes.add("BsdfAnisotropic", {"Roughness": 0.4, "Anisotropy": 0.8, "Tangent": tangent}))
    lit(s, material)


@each(
    {output.lower().replace(" ", "_"): output for output in ("Location", "Color", "Alpha", "Object Index", "Material Index", "Random")},
    samples=CHART,
)
def object_info(s: Stage, output: str) -> None:
    things = s.chart(lambda nodes: positive(nodes, (nodes.add("ObjectInfo"), output)))
    for k, thing in enumerate(things):
        thing.color, thing.pass_index = (0.9 - 0.3 * k, 0.2 + 0.3 * k, 0.5, 0.3 + 0.2 * k), k
    things[0].active_material.pass_index = 2


@case()
def object_info_of_instances(s: Stage) -> None:
    collection = s.data.collections.new("Parts")
    material, nodes = s.nodes()
    info = nodes.add("ObjectInfo")
    both = {"A_Color": positive(nodes, (info, "Location")), "B_Color": (info, "Random")}
    nodes.surface(nodes.add("Emission", {"Color": nodes.add("Mix", both, data_type="RGBA")}))
    ball = s.ball(material, at=(0.0, 0.0, 0.5), scale=(0.7, 0.7, 0.7))
    s.scene.collection.objects.unlink(ball)
    collection.objects.link(ball)
    for x in (-1.5, 0.0, 1.5):
        s.place("Instance", None, (x, 0.5 * x, 0.0), instance_type="COLLECTION", instance_collection=collection)


@each(
    {f"{kind}_{domain}".lower(): (kind, domain) for kind in ("FLOAT_COLOR", "BYTE_COLOR") for domain in ("POINT", "CORNER")}, samples=CHART
)
def color_attribute(s: Stage, variant: tuple[str, str]) -> None:
    things = s.chart(lambda nodes: nodes.add("VertexColor", layer_name="Paint"))
    kind, domain = variant
    for k, thing in enumerate(things):
        layer = thing.data.color_attributes.new("Paint", kind, domain)
        layer.data.foreach_set("color", np.random.default_rng(k).random(4 * len(layer.data), np.float32))


@each(
    {
        f"{kind}_{domain}".lower(): (kind, domain)
        for kind, domain in [
            ("FLOAT", "POINT"),
            ("FLOAT_VECTOR", "CORNER"),
            ("FLOAT", "FACE"),
            ("INT", "FACE"),
            ("FLOAT", "EDGE"),
            ("FLOAT2", "POINT"),
        ]
    },
    samples=CHART,
)
def attribute(s: Stage, variant: tuple[str, str]) -> None:
    things = s.chart(lambda nodes: nodes.add("Attribute", attribute_name="warmth"))
    kind, domain = variant
    for k, thing in enumerate(things[1:]):  # the floor has none
        layer = thing.data.attributes.new("warmth", kind, domain)
        name, width = {"FLOAT": ("value", 1), "INT": ("value", 1), "FLOAT_VECTOR": ("vector", 3), "FLOAT2": ("vector", 2)}[kind]
        values = np.random.default_rng(k).random(width * len(layer.data), np.float32)
        layer.data.foreach_set(name, (4 * values).astype(np.int32) if kind == "INT" else values)


@each(
    {
        "diffuse": ("BsdfDiffuse", {}),
        "glossy": ("BsdfAnisotropic", {"Roughness": 0.2}),
        "principled": ("BsdfPrincipled", {"Roughness": 0.4}),
    }
)
def normal_map(s: Stage, shader: tuple[str, dict[str, float]]) -> None:
    material, nodes = s.nodes()
    nodes.surface(nodes.add(shader[0], shader[1] | {"Normal": waves(s, nodes)}))
    lit(s, material)


@each({"object": "OBJECT", "world": "WORLD"})
def normal_map_in_space(s: Stage, space: str) -> None:
    material, nodes = s.nodes()
    nodes.surface(nodes.add("BsdfDiffuse", {"Normal": waves(s, nodes, space=space)}))
    lit(s, material)


@each({"diffuse": ("BsdfDiffuse", {}), "glossy": ("BsdfAnisotropic", {"Roughness": 0.3}), "coat": ("BsdfPrincipled", {"Coat Weight": 1.0})})
def bump(s: Stage, shader: tuple[str, dict[str, float]]) -> None:
    material, nodes = s.nodes()
    height = nodes.add("Math", {"Value": separate(nodes, scaled_uv(nodes), "X"), "Value_001": 6.0}, operation="MULTIPLY")
    wave = nodes.add("Math", {"Value": height}, operation="SINE")
    bumped = nodes.add("Bump", {"Height": wave, "Strength": 0.7, "Distance": 0.1})
    nodes.surface(nodes.add(shader[0], shader[1] | {"Coat Normal" if "Coat Weight" in shader[1] else "Normal": bumped}))
    lit(s, material)


@case()
def bump_from_an_image(s: Stage) -> None:
    material, nodes = s.nodes()
    texture = nodes.add("TexImage", image=s.image(colorspace="Non-Color"))
    nodes.surface(
        nodes.add("BsdfDiffuse", {"Normal": nodes.add("Bump", {"Height": texture, "Strength": 0.5, "Distance": 0.1}, invert=True)})
    )
    lit(s, material)


def waves(s: Stage, nodes: Nodes, **attributes: str) -> Any:
    """A normal map from a smooth image."""
    picture = s.image(16, 16, "Non-Color", float_buffer=True)
    x, y = np.meshgrid(np.arange(16), np.arange(16))
    normal = np.stack([0.4 * np.sin(x * np.pi / 4), 0.3 * np.cos(y * np.pi / 4), np.ones((16, 16))], axis=-1)
    texels = np.ones((16, 16, 4), np.float32)
    texels[..., :3] = normal / np.linalg.norm(normal, axis=-1, keepdims=True) / 2 + 0.5
    picture.pixels.foreach_set(texels.ravel())
    picture.pack()
    return nodes.add("NormalMap", {"Color": nodes.add("TexImage", image=picture), "Strength": 0.9}, **attributes)


def positive(nodes: Nodes, vector: Any) -> Any:
    """A vector with components within +-4, as a colour that is not negative."""
    return nodes.add(
        "VectorMath", {"Vector": vector, "Vector_001": (0.15, 0.15, 0.15), "Vector_002": (0.6, 0.6, 0.6)}, operation="MULTIPLY_ADD"
    )


def separate(nodes: Nodes, vector: Any, axis: str) -> Any:
    """One of a vector's numbers."""
    return nodes.add("SeparateXYZ", {"Vector": vector}), axis


def lit(s: Stage, material: Any) -> None:
    """Ball and box of a material, in light that shows shapes."""
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(material)
    s.box(material)
    s.lights()
