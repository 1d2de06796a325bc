"""Nodes that compute a value. The image shows the value as emission, for coordinates that vary across the set."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .registry import CHART, case, each

if TYPE_CHECKING:
    from ..stage import Nodes, Stage


def uv(nodes: Nodes) -> Any:
    """UV coordinates."""
    return nodes.add("TexCoord"), "UV"


def u(nodes: Nodes) -> Any:
    """The U of UV coordinates."""
    return nodes.add("SeparateXYZ", {"Vector": uv(nodes)}), "X"


def colors(nodes: Nodes) -> tuple[Any, Any]:
    """Two colours that vary; the first exceeds 1."""
    along = nodes.add("TexCoord")
    first = nodes.add(
        "VectorMath", {"Vector": (along, "UV"), "Vector_001": (1.3, 0.9, 1.0), "Vector_002": (0.0, 0.1, 0.4)}, operation="MULTIPLY_ADD"
    )
    second = nodes.add(
        "VectorMath",
        {"Vector": (along, "Generated"), "Vector_001": (0.8, -0.6, 0.9), "Vector_002": (0.1, 0.8, 0.0)},
        operation="MULTIPLY_ADD",
    )
    return first, second


def shown(nodes: Nodes, number: Any) -> Any:
    """A number within about +-3, shown as a positive brightness."""
    return nodes.add("Math", {"Value": number, "Value_001": 0.2, "Value_002": 0.7}, operation="MULTIPLY_ADD")


@each({mode.lower(): mode for mode in ("CONSTANT", "LINEAR", "EASE", "B_SPLINE", "CARDINAL")}, samples=CHART)
def color_ramp(s: Stage, mode: str) -> None:
    def paint(nodes: Nodes) -> Any:
        node = nodes.add("ValToRGB", {"Fac": u(nodes)})
        ramp = node.color_ramp
        ramp.interpolation = mode
        ramp.elements[0].color, ramp.elements[1].color = (0.9, 0.1, 0.1, 1.0), (0.1, 0.3, 0.9, 0.5)
        ramp.elements.new(0.33).color = (0.2, 0.8, 0.3, 1.0)
        return node

    s.chart(paint)


@case(samples=CHART)
def math_chain(s: Stage) -> None:
    def paint(nodes: Nodes) -> Any:
        value = u(nodes)
        for operation, operand in (("MULTIPLY", 7.0), ("SINE", 0.0), ("POWER", 2.0), ("SUBTRACT", 0.4), ("MAXIMUM", 0.1), ("SQRT", 0.0)):
            value = nodes.add("Math", {"Value": value, "Value_001": operand}, operation=operation)
        return value

    s.chart(paint)


@each(
    {operation.lower(): operation for operation in ("MODULO", "PINGPONG", "SNAP", "WRAP", "SMOOTH_MIN", "ARCTAN2", "LOGARITHM", "COMPARE")},
    samples=CHART,
)
def math(s: Stage, operation: str) -> None:
    s.chart(lambda nodes: shown(nodes, nodes.add("Math", {"Value": u(nodes), "Value_001": 0.3, "Value_002": 0.15}, operation=operation)))


@each(
    {operation.lower(): operation for operation in ("CROSS_PRODUCT", "NORMALIZE", "REFLECT", "FRACTION", "PROJECT", "DISTANCE")},
    samples=CHART,
)
def vector_math(s: Stage, operation: str) -> None:
    def paint(nodes: Nodes) -> Any:
        first, second = colors(nodes)
        result = nodes.add("VectorMath", {"Vector": first, "Vector_001": second}, operation=operation)
        return nodes.add("VectorMath", {"Vector": result, "Vector_001": (0.2,) * 3, "Vector_002": (0.7,) * 3}, operation="MULTIPLY_ADD")

    s.chart(paint)


BLENDS = ("MIX", "DARKEN", "MULTIPLY", "BURN", "LIGHTEN", "SCREEN", "DODGE", "ADD", "OVERLAY", "SOFT_LIGHT", "LINEAR_LIGHT", "DIFFERENCE")
BLENDS += ("EXCLUSION", "SUBTRACT", "DIVIDE", "HUE", "SATURATION", "COLOR", "VALUE")


@each({blend.lower(): blend for blend in BLENDS}, samples=CHART)
def mix(s: Stage, blend: str) -> None:
    def paint(nodes: Nodes) -> Any:
        first, second = colors(nodes)
        return nodes.add(
            "Mix", {"Factor_Float": 0.7, "A_Color": first, "B_Color": second}, data_type="RGBA", blend_type=blend, clamp_result=True
        )

    s.chart(paint)


@each({"float": "FLOAT", "vector": "VECTOR"}, samples=CHART)
def mix_of(s: Stage, kind: str) -> None:
    def paint(nodes: Nodes) -> Any:
        first, second = colors(nodes)
        suffix = kind.capitalize()
        return nodes.add("Mix", {"Factor_Float": u(nodes), f"A_{suffix}": first, f"B_{suffix}": second}, data_type=kind)

    s.chart(paint)


@case(samples=CHART)
def rgb_curves(s: Stage) -> None:
    def paint(nodes: Nodes) -> Any:
        node = nodes.add("RGBCurve", {"Fac": 0.8, "Color": colors(nodes)[0]})
        node.mapping.curves[0].points.new(0.4, 0.7)
        node.mapping.curves[2].points.new(0.6, 0.2)
        node.mapping.curves[3].points.new(0.5, 0.6)
        node.mapping.update()
        return node

    s.chart(paint)


@case(samples=CHART)
def float_curve(s: Stage) -> None:
    def paint(nodes: Nodes) -> Any:
        node = nodes.add("FloatCurve", {"Value": u(nodes)})
        node.mapping.curves[0].points.new(0.4, 0.7)
        node.mapping.update()
        return node

    s.chart(paint)


@case(samples=CHART)
def vector_curves(s: Stage) -> None:
    def paint(nodes: Nodes) -> Any:
        node = nodes.add("VectorCurve", {"Vector": colors(nodes)[0]})
        node.mapping.curves[1].points.new(0.3, 0.8)
        node.mapping.update()
        return nodes.add("VectorMath", {"Vector": node, "Vector_001": (0.4,) * 3, "Vector_002": (0.5,) * 3}, operation="MULTIPLY_ADD")

    s.chart(paint)


@each({mode.lower(): mode for mode in ("LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP")}, samples=CHART)
def map_range(s: Stage, mode: str) -> None:
    values = {"From Min": 0.2, "From Max": 0.8, "To Min": 0.9, "To Max": 0.1}
    s.chart(lambda nodes: nodes.add("MapRange", {"Value": u(nodes)} | values, interpolation_type=mode, clamp=mode != "LINEAR"))


@each(
    {
        "invert": ("Invert", {"Fac": 0.7}, {}),
        "gamma": ("Gamma", {"Gamma": 2.4}, {}),
        "bright_contrast": ("BrightContrast", {"Bright": 0.1, "Contrast": 0.4}, {}),
        "hue_saturation": ("HueSaturation", {"Hue": 0.65, "Saturation": 1.2, "Value": 0.9, "Fac": 0.8}, {}),
        "to_gray": ("RGBToBW", {}, {}),
    },
    samples=CHART,
)
def color_node(s: Stage, variant: tuple[str, dict[str, float], dict[str, str]]) -> None:
    kind, inputs, attributes = variant
    s.chart(lambda nodes: nodes.add(kind, {"Color": colors(nodes)[0]} | inputs, **attributes))


@each({mode.lower(): mode for mode in ("RGB", "HSV", "HSL")}, samples=CHART)
def separate_and_combine(s: Stage, mode: str) -> None:
    def paint(nodes: Nodes) -> Any:
        apart = nodes.add("SeparateColor", {"Color": colors(nodes)[1]}, mode=mode)
        return nodes.add("CombineColor", {"Red": (apart, "Green"), "Green": (apart, "Blue"), "Blue": (apart, "Red")}, mode=mode)

    s.chart(paint)


@each({kind.lower(): kind for kind in ("POINT", "TEXTURE", "VECTOR", "NORMAL")}, samples=CHART)
def mapping(s: Stage, kind: str) -> None:
    values = {"Rotation": (0.3, 0.2, 0.5), "Scale": (1.5, 0.7, 1.0)}
    values |= {"Location": (0.2, 0.1, 0.3)} if kind in ("POINT", "TEXTURE") else {}

    def paint(nodes: Nodes) -> Any:
        mapped = nodes.add("Mapping", {"Vector": colors(nodes)[1]} | values, vector_type=kind)
        return nodes.add("VectorMath", {"Vector": mapped, "Vector_001": (0.2,) * 3, "Vector_002": (0.5,) * 3}, operation="MULTIPLY_ADD")

    s.chart(paint)


@each({"glass": 1.45, "from_within": 0.7}, samples=CHART)
def fresnel(s: Stage, ior: float) -> None:
    s.chart(lambda nodes: nodes.add("Fresnel", {"IOR": ior}))


@each({output.lower(): output for output in ("Fresnel", "Facing")}, samples=CHART)
def layer_weight(s: Stage, output: str) -> None:
    s.chart(lambda nodes: (nodes.add("LayerWeight", {"Blend": 0.35}), output))


@case()
def fresnel_mixes_shaders(s: Stage) -> None:
    material, nodes = s.nodes()
    first, second = nodes.add("BsdfDiffuse", {"Color": (0.2, 0.4, 0.7)}), nodes.add("BsdfAnisotropic", {"Roughness": 0.1})
    nodes.surface(nodes.add("MixShader", {"Fac": nodes.add("Fresnel"), "Shader": first, "Shader_001": second}))
    s.lights()
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.ball(material)
    s.box(material)


RAYS = ("Is Camera Ray", "Is Shadow Ray", "Is Diffuse Ray", "Is Glossy Ray", "Is Transmission Ray")


@each({ray.lower().replace(" ", "_"): ray for ray in RAYS})
def light_path(s: Stage, output: str) -> None:
    """A ball that emits for some rays and is transparent for the others.

    Only scattered rays find the ball. Light sampling in Cycles would lose a part of its light, because it evaluates the emission for a ray
    without a kind.
    """
    material, nodes = s.nodes()
    material.cycles.emission_sampling = "NONE"
    clear, glow = (
        nodes.add("BsdfTransparent", {"Color": (0.9, 0.7, 0.8)}),
        nodes.add("Emission", {"Color": (1.0, 0.5, 0.2), "Strength": 2.0}),
    )
    nodes.surface(nodes.add("MixShader", {"Fac": (nodes.add("LightPath"), output), "Shader": clear, "Shader_001": glow}))
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.floor(s.material("BsdfGlossy", {"Roughness": 0.0}), size=4.0, location=(0.0, 2.0, 1.0), rotation_euler=(1.5, 0.0, 0.2))
    s.box(s.material("BsdfTranslucent", {"Color": (0.6, 0.7, 0.8)}))
    s.ball(material)
    s.lights()


@each({output.lower().replace(" ", "_"): output for output in ("Ray Length", "Ray Depth")})
def light_path_number(s: Stage, output: str) -> None:
    material, nodes = s.nodes()
    nodes.surface(nodes.add("Emission", {"Strength": shown(nodes, (nodes.add("LightPath"), output))}))
    s.floor(s.material("BsdfGlossy", {"Roughness": 0.0}))
    s.ball(material)
    s.box(material)


@case()
def backfacing_mixes_shaders(s: Stage) -> None:
    material, nodes = s.nodes()
    first, second = nodes.add("BsdfDiffuse", {"Color": (0.8, 0.2, 0.1)}), nodes.add("BsdfDiffuse", {"Color": (0.1, 0.3, 0.8)})
    nodes.surface(nodes.add("MixShader", {"Fac": (nodes.add("NewGeometry"), "Backfacing"), "Shader": first, "Shader_001": second}))
    s.lights()
    s.floor(s.diffuse((0.6, 0.6, 0.6)))
    s.floor(material, size=1.6, location=(-0.9, 0.0, 1.0), rotation_euler=(1.3, 0.0, 0.3))
    s.floor(material, size=1.6, location=(0.9, 0.0, 1.0), rotation_euler=(-1.3, 0.0, 0.3))


@case(samples=CHART)
def group_with_an_input(s: Stage) -> None:
    from ..stage import Nodes

    tree = s.data.node_groups.new("Group", "ShaderNodeTree")
    tree.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    tree.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketColor")
    inner = Nodes(tree, "NodeGroupOutput")
    entry = tree.nodes.new("NodeGroupInput")
    texture = inner.add("TexImage", image=s.image())
    product = inner.add(
        "Mix", {"Factor_Float": 1.0, "A_Color": texture, "B_Color": (entry, "Tint")}, data_type="RGBA", blend_type="MULTIPLY"
    )
    tree.links.new(
        product.outputs["Result"] if "Result" in product.outputs else product.outputs[2], tree.nodes["Group Output"].inputs["Result"]
    )

    s.chart(lambda nodes: nodes.add("Group", {"Tint": (0.9, 0.6, 0.3)}, node_tree=tree))


@case(samples=CHART)
def blackbody(s: Stage) -> None:
    def paint(nodes: Nodes) -> Any:
        kelvin = nodes.add("Math", {"Value": u(nodes), "Value_001": 9000.0, "Value_002": 1200.0}, operation="MULTIPLY_ADD")
        return nodes.add("Blackbody", {"Temperature": kelvin})

    s.chart(paint)


@each({"generated": False, "uv": True}, samples=CHART)
def checker(s: Stage, by_uv: bool) -> None:
    inputs = {"Color1": (0.9, 0.6, 0.3), "Color2": (0.1, 0.2, 0.4), "Scale": 4.3}
    s.chart(lambda nodes: nodes.add("TexChecker", inputs | ({"Vector": uv(nodes)} if by_uv else {})))


@each(
    {kind.lower(): kind for kind in ("LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL")}, samples=CHART
)
def gradient(s: Stage, kind: str) -> None:
    s.chart(lambda nodes: nodes.add("TexGradient", gradient_type=kind))


@each({"2d": {"noise_dimensions": "2D"}, "3d": {}, "not_normalized": {"normalize": False}}, samples=CHART)
def noise(s: Stage, attributes: dict[str, Any]) -> None:
    inputs = {"Scale": 3.0, "Detail": 2.5, "Roughness": 0.6, "Distortion": 0.3}
    s.chart(lambda nodes: shown(nodes, nodes.add("TexNoise", inputs, **attributes)))
