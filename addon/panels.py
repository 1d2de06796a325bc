"""The panels in Render properties, generated from the settings: a new setting needs no code here.

A setting's declaration names its panel (see `schema.setting`). The panels of a variant hang below the panel of its menu. Settings of a
variant that have no panel are drawn right below the menu.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import bpy

from blender_rl_guiding.schema import Entry, Settings, entries
from blender_rl_guiding.settings import DQN, Render

from . import presets, properties
from .network_picture import draw_network
from .panel import EnginePanel
from .text import draw_text

CLOSED = {"Learning", "Replay Memory", "Passes and Denoising"}  # until the user opens them


def _draw_guide(layout: bpy.types.UILayout, settings: Render, context: bpy.types.Context) -> None:
    column = layout.column(align=True)
    column.active = False  # grey
    draw_text(column, settings.guide.__doc__ or "", context)


# Drawn below the settings of a panel.
_AFTERWARDS: dict[tuple[type[Settings], str], Callable] = {(Render, "Method"): _draw_guide, (DQN, "Network"): draw_network}


@dataclass(frozen=True)
class Section:
    """The settings of one panel."""

    name: str  # unique: "dqn_learning"
    title: str
    config: type[Settings]
    path: tuple[str, ...]  # attribute path from `scene.rl_guiding` to the group of the values
    parent: str  # name of the section above this one; empty at the top

    @property
    def entries(self) -> list[Entry]:
        """In the order of their declaration."""
        return _shown_in(self.config, self.title)


def _shown_in(config: type[Settings], title: str) -> list[Entry]:
    return [entry for entry in entries(config) if entry.panel == title]


def sections(config: type[Settings], path: tuple[str, ...] = (), scope: str = "", parent: str = "") -> Iterator[Section]:
    """The panels of a class and of all its variants; parents before their children."""
    for title in dict.fromkeys(entry.panel for entry in entries(config)):
        here = parent
        if title:
            here = f"{scope}{title.lower().replace(' ', '_')}"
            yield Section(here, title, config, path, parent)
        for entry in _shown_in(config, title):
            for kind, variant in entry.variants.items():
                yield from sections(variant, (*path, f"{entry.name}_{kind}"), f"{scope}{kind}_", here)


def group_at(root: bpy.types.PropertyGroup, path: tuple[str, ...]) -> Any:
    """The PropertyGroup at the end of a path; None if another variant is chosen at any step of the path."""
    for step in path:
        menu, _, kind = step.rpartition("_")
        if getattr(root, menu) != kind:
            return None
        root = getattr(root, step)
    return root


def draw(layout: bpy.types.UILayout, group: bpy.types.PropertyGroup, shown: list[Entry]) -> None:
    """Draw settings. Below a menu, also draw the settings of the chosen variant that have no panel."""
    switches = None  # one column for consecutive switches
    for entry in shown:
        if entry.type is bool:
            switches = switches or layout.column(align=True)
            switches.prop(group, entry.name)
            continue
        switches = None
        place = layout.column()
        place.active = not entry.when or getattr(group, entry.when[0]) == entry.when[1]
        place.prop(group, entry.name)
        kind = getattr(group, entry.name) if entry.variants else ""
        if kind:  # a choice from another version reads as empty
            draw(layout, getattr(group, f"{entry.name}_{kind}"), _shown_in(entry.variants[kind], ""))


class SectionPanel(EnginePanel):
    """Base of the panels of all sections."""

    section: Section

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and group_at(context.scene.rl_guiding, cls.section.path) is not None

    def draw(self, context: bpy.types.Context) -> None:
        section, layout = self.section, self.layout
        group = group_at(context.scene.rl_guiding, section.path)
        layout.use_property_split = True
        layout.use_property_decorate = any(group.bl_rna.properties[entry.name].is_animatable for entry in section.entries)
        draw(layout, group, section.entries)
        if more := _AFTERWARDS.get((section.config, section.title)):
            more(layout, properties.read(group, section.config), context)


class WithPresets(SectionPanel):
    """The first panel has the menu of presets in its header."""

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        presets.RLG_PT_presets.draw_panel_header(self.layout)


def _panel(section: Section, base: type) -> type:
    idname = f"RLG_PT_{section.name}"
    says = {"bl_label": section.title, "bl_options": {"DEFAULT_CLOSED"} if section.title in CLOSED else set()}
    below = {"bl_parent_id": f"RLG_PT_{section.parent}"} if section.parent else {}
    about = f"{section.title}: settings of {section.config.label}."
    return type(idname, (base, bpy.types.Panel), {"bl_idname": idname, "section": section, "__doc__": about, **says, **below})


def make_panels() -> list[type]:
    """One panel for each section of `Render`, unregistered."""
    first, *others = sections(Render)
    return [_panel(first, WithPresets), *(_panel(section, SectionPanel) for section in others)]


_PANELS = make_panels()

register, unregister = bpy.utils.register_classes_factory(_PANELS)
