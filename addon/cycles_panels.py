"""Panels for Cycles' settings that this renderer uses, too. Cycles' own panels are visible only under Cycles."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy

from .panel import EnginePanel

_SURFACES = {"MESH", "CURVE", "SURFACE", "META", "FONT"}  # types of objects whose faces are rendered
_RAYS = {"camera": "Camera", "diffuse": "Diffuse", "glossy": "Glossy", "transmission": "Transmission"}

Test = Callable[[bpy.types.Context], Any]


@dataclass(frozen=True)
class Shown:
    """A panel of properties of Blender or Cycles."""

    name: str
    title: str
    tab: str  # of the Properties editor
    owners: dict[str, dict[str, str]]  # path of an owner in the context, such as "scene.cycles" -> its properties and their labels
    parent: str = ""
    switch: tuple[str, str] | None = None  # the path of an owner, and its property in the header
    poll: Test = lambda context: True
    active: Test = lambda context: True  # whether the properties have an effect; grey if not
    without: Callable[[bpy.types.Context], set[str]] = lambda context: set()  # properties to hide


_SHOWN = (
    Shown(
        "bounces",
        "Limits of the Scene",
        "render",
        {
            "scene.cycles": {
                "max_bounces": "Total",
                "diffuse_bounces": "Diffuse",
                "glossy_bounces": "Glossy",
                "transmission_bounces": "Transmission",
            }
        },
        parent="RLG_PT_light_paths",
        active=lambda context: context.scene.rl_guiding.max_bounces < 0,
    ),
    Shown(
        "roulette",
        "Transparency and Roulette",
        "render",
        {"scene.cycles": {"transparent_max_bounces": "Transparent Bounces", "min_light_bounces": "Min Light Bounces"}},
        parent="RLG_PT_light_paths",
    ),
    Shown(
        "film",
        "Film",
        "render",
        {
            "scene.cycles": {"film_exposure": "Exposure", "pixel_filter_type": "Pixel Filter", "filter_width": "Filter Width"},
            "scene.render": {"film_transparent": "Transparent"},
        },
        without=lambda context: {"filter_width"} if context.scene.cycles.pixel_filter_type == "BOX" else set(),
    ),
    Shown(
        "simplify",
        "Simplify",
        "render",
        {"scene.render": {"simplify_subdivision_render": "Max Subdivision", "simplify_child_particles_render": "Max Child Particles"}},
        switch=("scene.render", "use_simplify"),
        active=lambda context: context.scene.render.use_simplify,
    ),
    Shown(
        "object_rays",
        "Ray Visibility",
        "object",
        {"object": {f"visible_{kind}": label for kind, label in _RAYS.items()} | {"visible_shadow": "Shadow"}},
        parent="OBJECT_PT_visibility",
        poll=lambda context: context.object and context.object.type in _SURFACES | {"LIGHT"},
    ),
    Shown(
        "beam",
        "Beam Shape",
        "data",
        {"light": {"spread": "Spread"}},
        parent="DATA_PT_EEVEE_light",
        poll=lambda context: context.light and context.light.type == "AREA",
    ),
    Shown(
        "light_rays",
        "Rays",
        "data",
        {"light": {"use_shadow": "Cast Shadow"}, "light.cycles": {"use_multiple_importance_sampling": "Multiple Importance"}},
        parent="DATA_PT_EEVEE_light",
        poll=lambda context: context.light,
    ),
    Shown("world_rays", "Ray Visibility", "world", {"world.cycles_visibility": _RAYS}, poll=lambda context: context.world),
)


def _at(root: Any, path: str) -> Any:
    """The value at a path by dots; None if Blender runs without Cycles."""
    for name in path.split("."):
        root = getattr(root, name, None)
    return root


class ShownPanel(EnginePanel):
    """Draws an entry of `_SHOWN`."""

    bl_options = {"DEFAULT_CLOSED"}
    shown: Shown

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not (super().poll(context) and cls.shown.poll(context)):
            return False
        return any(_at(context, owner) is not None for owner in cls.shown.owners)

    def draw_header(self, context: bpy.types.Context) -> None:
        if self.shown.switch:
            path, name = self.shown.switch
            self.layout.prop(_at(context, path), name, text="")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = self.shown.tab == "data"  # keyframe buttons, where Cycles has them
        layout.active = bool(self.shown.active(context))
        for path, names in self.shown.owners.items():
            column = layout.column(align=True)
            if owner := _at(context, path):
                for name in (name for name in names if name not in self.shown.without(context)):
                    column.prop(owner, name, text=names[name])


class SurfacePanel(EnginePanel):
    """The nodes of the material output that Cycles and this renderer use."""

    bl_label = "Surface"
    owner: str  # in the context

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and _at(context, f"{cls.owner}.node_tree") is not None

    def draw(self, context: bpy.types.Context) -> None:
        tree = _at(context, f"{self.owner}.node_tree")
        self.layout.use_property_split = True
        if output := tree.get_output_node("CYCLES"):
            self.layout.template_node_view(tree, output, output.inputs["Surface"])
        else:
            self.layout.label(text="No output node", icon="INFO")


def _make_panels() -> list[type]:
    panels = []
    for owner, tab in (("material", "material"), ("world", "world"), ("light", "data")):
        says = {"owner": owner, "bl_context": tab, "__doc__": SurfacePanel.__doc__}
        panels.append(type(f"RLG_PT_surface_{owner}", (SurfacePanel, bpy.types.Panel), says))
    for shown in _SHOWN:
        place = {"bl_parent_id": shown.parent} if shown.parent else {}
        says = {"bl_label": shown.title, "bl_context": shown.tab, "shown": shown, "__doc__": f"{shown.title}: settings of Cycles."}
        panels.append(type(f"RLG_PT_cycles_{shown.name}", (ShownPanel, bpy.types.Panel), says | place))
    return panels


_PANELS = _make_panels()

# Registered after the panels of `panels.py`, because some are their sub-panels.
register, unregister = bpy.utils.register_classes_factory(_PANELS)
