"""Texture nodes: images, skies and procedural patterns."""

from collections.abc import Callable

import bpy

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.scene.data import Texture
from blender_rl_guiding.scene.description import Value
from blender_rl_guiding.scene.ops import Extension, Interpolation, Projection

from ..by_cycles import opaque
from ..images import read_image
from ..network import At, Reader, link_to
from ..sky import read_sky, usual_color
from .inputs import generated, uv


def _vector(at: At, implicit: Callable[[At], Value]) -> Value:
    """The coordinates of a texture node."""
    mapping = getattr(at.node, "texture_mapping", None)
    if mapping and (any(mapping.translation) or any(mapping.rotation) or tuple(mapping.scale) != (1.0, 1.0, 1.0)):
        at.note("texture mapping: the coordinates are not mapped")
    return at.value("Vector", lambda: implicit(at))


def _scaled(at: At, vector: Value) -> Value:
    return at.add("vector_math", vector, 0.0, 0.0, at.value("Scale"), mode="SCALE")


def _image(at: At, output: str) -> Value:
    node = at.node
    if node.projection != "FLAT":
        at.note(f"projection {node.projection}: FLAT stands in")
    texture, alpha = read_image(at, wants_alpha=_wants_alpha(node))
    options = (texture, Extension[node.extension], _interpolation(at))
    if output == "Alpha":
        return at.add("image_alpha", _vector(at, uv), options=options)
    return at.add("image", _vector(at, uv), options=(*options, alpha))


def _wants_alpha(node: bpy.types.ShaderNodeTexImage) -> bool:
    """Whether the Alpha socket of this node or of an equal node is linked, because Cycles merges equal nodes."""
    twins = (n for n in node.id_data.nodes if n.bl_idname == node.bl_idname and _settings(n) == _settings(node))
    return any(twin.outputs["Alpha"].is_linked for twin in twins)


def _settings(node: bpy.types.ShaderNodeTexImage) -> tuple:
    link = link_to(node.inputs["Vector"])
    return node.image, node.extension, node.interpolation, node.projection, link.from_socket if link else None


def _environment(at: At, _output: str) -> Value:
    if at.node.image and at.node.image.source == "TILED":
        at.note(f"image '{at.node.image.name}' has tiles, but surroundings have not: magenta stands in, as in Cycles")
        return 1.0, 0.0, 1.0
    texture, _ = read_image(at, wants_alpha=False)
    options = (texture, Projection[at.node.projection], _interpolation(at))
    return at.add("environment", _vector(at, lambda at: at.add("position")), options=options)


def _sky(at: At, _output: str) -> Value:
    try:
        sky = read_sky(at.node, at.network.resources.stop)
    except InputError as error:
        at.note(f"there is no picture of it, {error}: the usual colour of its model stands in")
        return usual_color(at.node)
    resources = at.network.resources
    direction = _vector(at, generated)
    if sky.rotation:
        direction = at.add("mapping", direction, 0.0, (0.0, 0.0, sky.rotation), 1.0, mode="VECTOR")
    texture = resources.texture(("sky", sky.picture.tobytes()), lambda: Texture(at.node.name, False, opaque(sky.picture)))
    color = at.add("environment", direction, options=(texture, Projection.HORIZON, Interpolation.LINEAR))
    if not sky.disc.any() or at.node.sun_intensity == 0:
        return color
    options = resources.table(opaque(sky.disc)), bpy.app.version < (5, 0)
    return at.add("sun_disc", direction, color, sky.elevation, sky.size, at.node.sun_intensity, options=options)


def _interpolation(at: At) -> int:
    if at.node.interpolation in ("Cubic", "Smart"):
        at.note(f"interpolation {at.node.interpolation}: Linear stands in")
    return Interpolation.CLOSEST if at.node.interpolation == "Closest" else Interpolation.LINEAR


def _checker(at: At, output: str) -> Value:
    vector = _scaled(at, _vector(at, generated))
    return at.add("checker", vector, at.value("Color1"), at.value("Color2"), mode=_result(output))


def _gradient(at: At, _output: str) -> Value:
    return at.add("gradient", _vector(at, generated), mode=at.node.gradient_type)


def _white_noise(at: At, output: str) -> Value | None:
    dimensions = int(at.node.noise_dimensions[0])
    if dimensions == 4:
        return _unsupported_noise(at, "4 dimensions")
    vector = at.value("W") if dimensions == 1 else at.value("Vector")
    return at.add("white_noise", vector, mode=_result(output), options=(dimensions,))


def _noise(at: At, output: str) -> Value | None:
    dimensions = int(at.node.noise_dimensions[0])
    if dimensions == 4 or at.node.noise_type != "FBM":
        return _unsupported_noise(at, "4 dimensions" if dimensions == 4 else at.node.noise_type)
    vector = _scaled(at, at.value("W") if dimensions == 1 else _vector(at, generated))
    values = (at.value(name) for name in ("Detail", "Roughness", "Lacunarity", "Distortion"))
    return at.add("noise", vector, *values, mode=_result(output), options=(dimensions, int(at.node.normalize)))


def _unsupported_noise(at: At, detail: str) -> None:
    at.note(f"noise of {detail} is not supported: the unlinked values of the sockets that it leads to stand in")


def _result(output: str) -> str:
    return "COLOR" if output == "Color" else "FACTOR"


READERS: dict[str, Reader] = {
    "ShaderNodeTexImage": _image,
    "ShaderNodeTexEnvironment": _environment,
    "ShaderNodeTexSky": _sky,
    "ShaderNodeTexChecker": _checker,
    "ShaderNodeTexGradient": _gradient,
    "ShaderNodeTexWhiteNoise": _white_noise,
    "ShaderNodeTexNoise": _noise,
}
