"""Settings as Blender shows them: same defaults, same limits, nothing lost on the way in, out or through a file."""

from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import bpy
import pytest

from addon import panels
from addon.properties import read, write
from blender_rl_guiding.schema import entries, flags
from blender_rl_guiding.settings import DQN, Encoder, Frequency, Guide, NoEncoding, Render, Uniform

UNUSUAL = Render(
    spp=7,
    max_bounces=3,
    nee=True,
    seed=2**31 - 1,
    guide=DQN(NoEncoding(), weights="radiance", bsdf_fraction=0.1, learning_rate=1e-8, memory=99_999),
)


def test_defaults_are_those_of_the_settings(scene: bpy.types.Scene):
    assert read(scene.rl_guiding, Render) == Render()


@pytest.mark.parametrize("guide", [*(guide() for guide in get_args(Guide)), *(DQN(encoder=variant()) for variant in get_args(Encoder))])
def test_every_variant_survives_the_way_in_and_out(scene: bpy.types.Scene, guide: Guide):
    write(scene.rl_guiding, Render(guide=guide))
    assert read(scene.rl_guiding, Render) == Render(guide=guide)


def test_values_survive_save_and_reopen(scene: bpy.types.Scene, tmp_path: Path):
    write(scene.rl_guiding, UNUSUAL)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert read(bpy.context.scene.rl_guiding, Render) == UNUSUAL


def test_a_variant_keeps_its_values_while_another_is_chosen(scene: bpy.types.Scene):
    write(scene.rl_guiding, UNUSUAL)
    scene.rl_guiding.guide = "uniform"
    assert read(scene.rl_guiding, Render) == replace(UNUSUAL, guide=Uniform())
    scene.rl_guiding.guide = "dqn"
    assert read(scene.rl_guiding, Render) == UNUSUAL


@pytest.mark.parametrize("side", [0, 1])
def test_numbers_are_clamped_to_their_limits(scene: bpy.types.Scene, side: int):
    groups = {Render: scene.rl_guiding, DQN: scene.rl_guiding.guide_dqn, Frequency: scene.rl_guiding.guide_dqn.encoder_frequency}
    for config, group in groups.items():
        for entry in entries(config):
            if entry.type in (int, float) and entry.limits[side] is not None:
                setattr(group, entry.name, [-(2**31), 2**31 - 1][side])
                assert getattr(read(group, config), entry.name) == entry.limits[side], entry.name


class Layout(SimpleNamespace):
    """Stands in for Blender's layout and notes what is drawn."""

    def prop(self, group: bpy.types.PropertyGroup, name: str) -> None:
        assert name in group.bl_rna.properties
        self.drawn.append(name)

    def column(self, align: bool) -> "Layout":
        return self


@pytest.mark.parametrize(("guide", "shown"), [("bsdf", set()), ("dqn", {f.name for f in fields(DQN)} | {"octaves"})])
def test_the_panel_shows_the_chosen_variant_alone(scene: bpy.types.Scene, guide: str, shown: set[str]):
    scene.rl_guiding.guide = guide
    layout = Layout(drawn=[])
    panels.draw(layout, scene.rl_guiding, Render)
    assert set(layout.drawn) == {f.name for f in fields(Render)} | shown
    assert len(layout.drawn) == len(set(layout.drawn))


def test_every_property_has_the_help_of_its_setting(scene: bpy.types.Scene):
    for name, entry in flags(Render):
        if "." not in name:
            assert scene.rl_guiding.bl_rna.properties[name].description == entry.doc.rstrip(".")
