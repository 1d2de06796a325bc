"""Settings as properties of Blender: same defaults, same limits, and no loss when set, read or saved."""

from dataclasses import replace
from pathlib import Path
from typing import get_args

import bpy
import pytest

from addon.properties import read, write
from blender_rl_guiding.flat import flags
from blender_rl_guiding.schema import entries
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


def test_every_property_has_the_help_of_its_setting(scene: bpy.types.Scene):
    for name, entry in flags(Render):
        if "." not in name:
            assert scene.rl_guiding.bl_rna.properties[name].description == entry.doc.rstrip(".")


def test_only_numbers_of_the_render_are_animated(scene: bpy.types.Scene):
    animated = {p.identifier for p in scene.rl_guiding.bl_rna.properties if p.is_animatable and p.type != "POINTER"} - {"name"}
    assert animated == {"spp", "noise", "seconds", "seed", "emphasis", "max_bounces"}
    assert not any(p.is_animatable for p in scene.rl_guiding.guide_dqn.bl_rna.properties if p.type in ("INT", "FLOAT", "ENUM"))


def test_an_animated_setting_is_read_from_the_scene_that_renders(scene: bpy.types.Scene):
    seen = []

    class Reader(bpy.types.RenderEngine):
        """An engine that reads the settings."""

        bl_idname = "RL_GUIDED_READER"
        bl_label = "RL Guided Reader"

        def render(self, depsgraph: bpy.types.Depsgraph) -> None:
            seen.append(read(depsgraph.scene.rl_guiding, Render).seed)

    for frame, seed in ((1, 10), (2, 20)):
        scene.rl_guiding.seed = seed
        assert scene.keyframe_insert("rl_guiding.seed", frame=frame)
    bpy.utils.register_class(Reader)
    try:
        scene.render.engine = Reader.bl_idname
        for frame in (2, 1):
            scene.frame_set(frame)
            bpy.ops.render.render()
    finally:
        bpy.utils.unregister_class(Reader)
    assert seen == [20, 10]


def test_shares_are_sliders_and_small_numbers_are_readable(scene: bpy.types.Scene):
    guide = scene.rl_guiding.guide_dqn.bl_rna.properties
    assert {name for name, p in guide.items() if p.subtype == "FACTOR"} == {"bsdf_fraction", "tau"}
    rate = guide["learning_rate"]
    assert rate.precision == 3
    assert rate.step / 100 == pytest.approx(1e-3, rel=0.01)  # step of a click on an arrow
    assert scene.rl_guiding.bl_rna.properties["seconds"].unit == "TIME_ABSOLUTE"
    assert (rate.soft_min, rate.hard_max) == (pytest.approx(1e-4), 10)


def test_menus_show_labels(scene: bpy.types.Scene):
    root, dqn = scene.rl_guiding, scene.rl_guiding.guide_dqn
    shown = {
        name: [item.name for item in group.bl_rna.properties[name].enum_items]
        for group in (root, dqn)
        for name in ("guide", "encoder", "activation", "loss")
        if name in group.bl_rna.properties
    }
    assert shown == {
        "guide": ["Uniform", "Material (BSDF)", "Q-Table", "Deep Q-Network", "Lobes (vMF)"],
        "encoder": ["No Encoding", "Frequency Encoding", "Radial Basis Functions", "B-Splines"],
        "activation": ["ReLU", "SiLU", "Tanh"],
        "loss": ["DQN", "C-DQN"],
    }
