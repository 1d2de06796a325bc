"""The coverage report: everything of a scene that the bundle does not take over, and only what would change the image."""

from collections.abc import Iterable, Iterator, Sequence

import bpy

from blender_rl_guiding.scene.data import Loss

# Everything else that is not a mesh leaves no trace in a render: empties, armatures, lattices, cameras, speakers, probes.
# Texts, curves, surfaces and metaballs with a surface come as meshes of their own beside themselves.
_VISIBLE = {
    "CURVES": "hair curves",
    "POINTCLOUD": "point cloud",
    "VOLUME": "volume",
    "GREASEPENCIL": "grease pencil",
}


def summary(losses: Sequence[Loss]) -> str:
    """One line: how much is lost, and the first of it."""
    first = losses[0]
    where = f", {first.where}" if first.where else ""
    return f"{len(losses)} thing(s) cannot be exported, the first: '{first.object}'{where}: {first.detail}"


def of_instance(instance: bpy.types.DepsgraphObjectInstance, view_layer: bpy.types.ViewLayer) -> Iterator[Loss]:
    """What is lost of one object, its materials aside."""
    thing = instance.object
    if instance.show_self:
        yield from (Loss(thing.name, "", detail) for detail in _of_object(thing, view_layer))
    if instance.show_particles:
        for system in thing.particle_systems:
            if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
                yield Loss(thing.name, f"particle system '{system.name}'", "hair is left out")


def _of_object(thing: bpy.types.Object, view_layer: bpy.types.ViewLayer) -> Iterator[str]:
    if thing.type == "LIGHT":
        if thing.data.energy and any(thing.data.color):
            yield f"{thing.data.type.lower()} lamp is left out: lamps are not supported yet"
    elif thing.type in _VISIBLE:
        yield f"{_VISIBLE[thing.type]} is left out"
    elif isinstance(thing.data, bpy.types.Mesh) and len(thing.data.polygons):
        yield from _of_mesh_object(thing, view_layer)


def _of_mesh_object(thing: bpy.types.Object, view_layer: bpy.types.ViewLayer) -> Iterator[str]:
    # Rays of other kinds (glossy, transmission, volume) exist only with materials that are listed themselves.
    for kind in ("camera", "diffuse", "shadow"):
        if not getattr(thing, f"visible_{kind}"):
            yield f"ray visibility: visible to {kind} rays, although switched off"
    original = thing.original
    if thing.is_holdout or original.holdout_get(view_layer=view_layer):
        yield "holdout: a normal surface stands in"
    if thing.is_shadow_catcher:
        yield "shadow catcher: a normal surface stands in"
    if original.indirect_only_get(view_layer=view_layer):
        yield "indirect only: visible to the camera, although its collection is not"
    if thing.modifiers and getattr(thing.modifiers[-1], "use_adaptive_subdivision", False):
        yield "adaptive subdivision: the render level of the modifier stands in"
    if thing.light_linking.receiver_collection or thing.light_linking.blocker_collection:
        yield "light linking: lights everything"


def of_scene(scene: bpy.types.Scene) -> Iterator[Loss]:
    """What is lost of the render settings that change the scene; Cycles' own trade of noise for bias is not part of a scene."""
    render = scene.render
    yield from (Loss(scene.name, "render settings", detail) for detail, lost in _render_settings(scene) if lost)
    layers = [layer.name for layer in scene.view_layers if layer.use]
    yield from (Loss(scene.name, f"view layer '{name}'", "left out: only the first is exported") for name in layers[1:])
    if render.use_motion_blur and len(bpy.data.actions):
        yield Loss(scene.name, "render settings", "motion blur: everything stands still at the frame's own time")


def _render_settings(scene: bpy.types.Scene) -> Iterable[tuple[str, bool]]:
    render = scene.render
    exposure = scene.cycles.film_exposure if hasattr(scene, "cycles") else 1.0
    return (
        ("render region: the whole frame is rendered", render.use_border),
        ("stereoscopy: only the scene's camera is exported", render.use_multiview),
        ("transparent film: the world is visible behind the scene", render.film_transparent),
        ("freestyle: lines are left out", render.use_freestyle),
        (f"film exposure {exposure:g}: the image is not multiplied", exposure != 1.0),
    )
