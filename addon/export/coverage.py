"""The coverage report: one `Loss` for each thing that is missing in the bundle and would change the image."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import bpy

from blender_rl_guiding.scene.description import CAMERA, Closure, Loss, Shader, emits

from .visibility import source, visibility

# Object types that a render shows, beside meshes. Empties, armatures, lattices, cameras, speakers and probes are never visible. Blender
# also lists texts, curves, surfaces and metaballs with a surface as meshes.
_VISIBLE = {
    "CURVES": "hair curves",
    "POINTCLOUD": "point cloud",
    "VOLUME": "volume",
    "GREASEPENCIL": "grease pencil",
}

# Losses only of a bundle, because it is one image. A render inside Blender has all layers and the whole frame.
ONE_LAYER = "left out: only the first is exported"
CROPPED = "render region: the image is cropped to it, instead of black around it"

_GRAZING = 0.1  # geometry offset of the shadow terminator in the renderer: Cycles' default


def summary(losses: Sequence[Loss]) -> str:
    """One line: the number of losses, and the first."""
    first = losses[0]
    where = f", {first.where}" if first.where else ""
    return f"{len(losses)} thing(s) cannot be exported, the first: '{first.object}'{where}: {first.detail}"


def in_blender(losses: Iterable[Loss]) -> tuple[Loss, ...]:
    """The losses of a render inside Blender, computed from the losses of a bundle."""
    return tuple(loss for loss in losses if loss.detail not in (ONE_LAYER, CROPPED))


def of_instance(instance: bpy.types.DepsgraphObjectInstance, view_layer: bpy.types.ViewLayer) -> Iterator[Loss]:
    """The losses of one object, without its materials. For lamps see `read_lamp`."""
    thing = instance.object
    if instance.show_self:
        yield from (Loss(thing.name, "", detail) for detail in _of_object(instance, view_layer))
    if instance.show_particles:
        for system in thing.particle_systems:
            if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
                yield Loss(thing.name, f"particle system '{system.name}'", "hair is left out")


def _of_object(instance: bpy.types.DepsgraphObjectInstance, view_layer: bpy.types.ViewLayer) -> Iterator[str]:
    thing = instance.object
    seen = visibility(instance, view_layer)
    if not seen:
        return
    if thing.type in _VISIBLE:
        yield f"{_VISIBLE[thing.type]} is left out"
    elif isinstance(thing.data, bpy.types.Mesh) and (len(thing.data.polygons) or thing.data.is_editmode):
        if seen & CAMERA:
            yield from _of_compositing(thing, source(instance).original.holdout_get(view_layer=view_layer))
        yield from _of_mesh_object(thing)


def _of_compositing(thing: bpy.types.Object, held_out: bool) -> Iterator[str]:
    if thing.is_holdout or held_out:
        yield "holdout: a normal surface stands in"
    if thing.is_shadow_catcher:
        yield "shadow catcher: a normal surface stands in"


def _of_mesh_object(thing: bpy.types.Object) -> Iterator[str]:
    if thing.modifiers and getattr(thing.modifiers[-1], "use_adaptive_subdivision", False):
        yield "adaptive subdivision: the render level of the modifier stands in"
    if hasattr(thing, "cycles"):
        yield from _of_terminator(thing.cycles, smooth=thing.data.normals_domain != "FACE")


def of_linking(thing: bpy.types.Object, shaders: Iterable[Shader]) -> Iterator[Loss]:
    """The loss of a mesh that emits and has light linking."""
    linking = thing.light_linking
    if (linking.receiver_collection or linking.blocker_collection) and any(emits(c) for shader in shaders for c in shader.closures):
        yield Loss(thing.name, "", "light linking: lights everything")


def of_shaders(scene: bpy.types.Scene, shaders: Iterable[Shader]) -> Iterator[Loss]:
    """The losses of render settings for reflection and refraction, if a shader in use reflects or refracts."""
    if not hasattr(scene, "cycles"):
        return
    cycles, closures = scene.cycles, [closure for shader in shaders for closure in shader.closures]
    reflects, refracts = (any(map(does, closures)) for does in (_reflects, _refracts))
    settings = (
        ("reflective caustics are off: they are still rendered", reflects and not cycles.caustics_reflective),
        ("refractive caustics are off: they are still rendered", refracts and not cycles.caustics_refractive),
        (
            "transparent glass: the world is visible through glass",
            refracts and scene.render.film_transparent and cycles.film_transparent_glass,
        ),
    )
    yield from (Loss(scene.name, "render settings", detail) for detail, lost in settings if lost)


def _reflects(closure: Closure) -> bool:
    return closure.kind in ("glossy", "metallic", "glass", "principled")


def _refracts(closure: Closure) -> bool:
    return closure.kind in ("glass", "refraction") or closure.inputs.get("transmission", 0.0) != 0.0


def of_links(depsgraph: bpy.types.Depsgraph) -> Iterator[Loss]:
    """A loss for each data-block of the image that Blender itself could not find or compute."""
    for block in depsgraph.ids:
        if block.original.is_missing:
            library = block.original.library
            yield Loss(block.name, "", f"missing: its library {library.filepath if library else ''} cannot be read")
        if bpy.app.autoexec_fail and not block.is_embedded_data:
            owner = getattr(block, "user", block)  # of shape keys: their mesh
            yield from (
                Loss(owner.name, f"driver of {path}", "it needs Python, and scripts do not run: 0 stands in") for path in _refused(block)
            )


def _refused(block: bpy.types.ID) -> Iterator[str]:
    """The properties whose drivers need Python. Blender computes simple expressions without scripts."""
    tree = None if isinstance(block, bpy.types.Scene) else getattr(block, "node_tree", None)
    for data in (getattr(owner, "animation_data", None) for owner in (block, tree)):
        for curve in data.drivers if data else ():
            if curve.driver.type == "SCRIPTED" and not curve.driver.is_valid and not curve.mute:
                yield f"{curve.data_path}[{curve.array_index}]"


def _of_terminator(cycles: Any, smooth: bool) -> Iterator[str]:
    geometry = cycles.shadow_terminator_geometry_offset
    if smooth and abs(geometry - _GRAZING) > 1e-6:
        yield f"shadow terminator, geometry offset {geometry:g}: {_GRAZING} stands in"
    if cycles.shadow_terminator_offset:
        yield f"shadow terminator, shading offset {cycles.shadow_terminator_offset:g}: 0 stands in"


def of_scene(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> Iterator[Loss]:
    """The losses of render settings that change the scene. Settings of Cycles that only trade noise for bias are no losses."""
    yield from (Loss(scene.name, "render settings", detail) for detail, lost in _render_settings(scene) if lost)
    layers = [layer.name for layer in scene.view_layers if layer.use]
    yield from (Loss(scene.name, f"view layer '{name}'", ONE_LAYER) for name in layers[1:])
    for kind in ("material", "world"):
        if getattr(view_layer, f"{kind}_override", None):
            yield Loss(scene.name, f"view layer '{view_layer.name}'", f"{kind} override: not applied")
    for kind, shown in (("Environment", view_layer.use_sky), ("Surfaces", view_layer.use_solid)):
        if not shown:
            yield Loss(scene.name, f"view layer '{view_layer.name}'", f"filter {kind} is off: rendered all the same")


def _render_settings(scene: bpy.types.Scene) -> Iterable[tuple[str, bool]]:
    render = scene.render
    return (
        ("stereoscopy: only the scene's camera is exported", render.use_multiview),
        ("freestyle: lines are left out", render.use_freestyle),
        ("fast global illumination: all bounces are traced", hasattr(scene, "cycles") and scene.cycles.use_fast_gi),
    )
