"""Panels are made from the settings. Each setting of a chosen variant is in one panel, with a readable label."""

from typing import get_args

import bpy
import pytest

from addon import panels
from addon.network_picture import abridged, numbers
from addon.properties import write
from blender_rl_guiding.flat import active, flags
from blender_rl_guiding.schema import entries
from blender_rl_guiding.settings import DQN, RBF, Encoder, Guide, QTable, Render
from tests.addon.layout import Layout, context, drawn

GUIDES = [*(guide() for guide in get_args(Guide)), *(DQN(encoder=variant()) for variant in get_args(Encoder))]


def shown(scene: bpy.types.Scene) -> dict[str, list[str]]:
    """Panel name -> settings that the panel draws, as paths below the scene's settings, for each visible panel."""
    where = context(scene)
    visible = {panel.bl_idname: drawn(panel, where) for panel in panels._PANELS if panel.poll(where)}
    return {name: [_path(one.owner, one.name) for one in layout.drawn if one.kind == "prop"] for name, layout in visible.items()}


def _path(owner: bpy.types.PropertyGroup, name: str) -> str:
    """The name in `flat.flags`: dqn.encoder for rl_guiding.guide_dqn.encoder."""
    group = owner.path_from_id().rpartition(".")[2]
    return name if group == "rl_guiding" else f"{group.partition('_')[2]}.{name}"


@pytest.mark.parametrize("guide", GUIDES)
def test_every_setting_is_drawn_in_exactly_one_panel(scene: bpy.types.Scene, guide: Guide):
    write(scene.rl_guiding, Render(guide=guide))
    drawn_paths = [path for paths in shown(scene).values() for path in paths]
    assert sorted(drawn_paths) == sorted(active(Render(guide=guide)))


def test_panels_of_the_chosen_guide_hang_below_its_menu(scene: bpy.types.Scene):
    below = {}
    for guide in ("bsdf", "qtable", "dqn"):
        scene.rl_guiding.guide = guide
        visible = [panel for panel in panels._PANELS if panel.poll(context(scene))]
        below[guide] = [panel.bl_label for panel in visible if getattr(panel, "bl_parent_id", "") == "RLG_PT_method"]
        assert [panel.bl_label for panel in visible if not hasattr(panel, "bl_parent_id")] == [
            "Method", "Sampling", "Light Paths", "Passes and Denoising",
        ]  # fmt: skip
    assert below == {
        "bsdf": [],
        "qtable": ["Directions", "Table", "Learning"],
        "dqn": ["Encoder", "Network", "Directions", "Learning", "Replay Memory"],
    }


def test_panels_are_of_this_engine(scene: bpy.types.Scene):
    assert not any(panel.poll(context(scene, "CYCLES")) for panel in panels._PANELS)


def test_what_has_no_effect_is_grey(scene: bpy.types.Scene):
    group = scene.rl_guiding.guide_dqn
    greyed = {}
    for schedule in ("exponential", "cosine"):
        group.schedule = schedule
        layout = Layout()
        panels.draw(layout, group, [entry for entry in entries(DQN) if entry.panel == "Learning"])
        greyed[schedule] = [one.name for one in layout.drawn if not one.active]
    assert greyed == {"exponential": [], "cosine": ["decay"]}


def test_conditions_name_choices_of_their_own_class():
    for config in (Render, *get_args(Guide), *get_args(Encoder)):
        members = {entry.name: entry for entry in entries(config)}
        for entry in members.values():
            assert entry.when is None or entry.when[1] in members[entry.when[0]].choices


def test_labels_are_for_people():
    for name, entry in flags(Render):
        labels = [
            entry.label,
            *(choice.label for choice in entry.choices.values()),
            *(variant.label for variant in entry.variants.values()),
        ]
        assert all(label[0].isupper() and "_" not in label for label in labels), name
        assert len(set(labels[1:])) == len(labels) - 1, name
    for section in panels.sections(Render):
        assert len({entry.label for entry in section.entries}) == len(section.entries), section


def test_soft_limits_lie_within_limits():
    for name, entry in flags(Render):
        for soft, hard, sign in zip(entry.soft, entry.limits, (1, -1), strict=True):
            assert soft is None or hard is None or sign * (soft - hard) >= 0, name
        if entry.type in (int, float) and None not in entry.soft:
            assert entry.soft[0] <= entry.default <= entry.soft[1], name


def test_the_chosen_guide_is_described(scene: bpy.types.Scene):
    for guide in get_args(Guide):
        scene.rl_guiding.guide = guide.kind
        assert " ".join(drawn(panels._PANELS[0], context(scene)).texts) == guide.__doc__


def test_the_network_is_drawn(scene: bpy.types.Scene):
    write(scene.rl_guiding, Render(guide=DQN()))
    (network,) = (panel for panel in panels._PANELS if panel.bl_label == "Network")
    assert drawn(network, context(scene)).texts == ["30 → 96 → 96 → 360", "47.2 k parameters, table 32³"]
    write(scene.rl_guiding, Render(guide=DQN(encoder=RBF())))
    assert drawn(network, context(scene)).texts[:2] == ["encoder 108 → 64 → 64 → 24", "30 → 96 → 96 → 360"]


def test_large_and_small_networks_stay_on_their_line():
    assert abridged((30, *[96] * 12, 360)) == ["30", "12 × 96", "360"]
    assert numbers(DQN(layers=1, rows=1, columns=1)) == "31 parameters, table 32³"
    assert numbers(DQN(width=4096)) == "18.4 M parameters, table 32³"


def test_only_what_can_be_animated_has_room_for_it(scene: bpy.types.Scene):
    write(scene.rl_guiding, Render(guide=QTable()))
    decorated = {
        panel.bl_label: drawn(panel, context(scene)).use_property_decorate for panel in panels._PANELS if panel.poll(context(scene))
    }
    assert decorated == {
        "Method": False, "Directions": False, "Table": False, "Learning": False, "Sampling": True, "Light Paths": True,
        "Passes and Denoising": False,
    }  # fmt: skip
