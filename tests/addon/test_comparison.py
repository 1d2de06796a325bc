"""Comparing methods in Blender: the list of methods, the runs, and the data kept in the file. Commands give the same bits."""

import json
import os
import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon import commands, worker_client
from addon import installation as environment
from addon.comparison import methods, operators, slots, workspace
from addon.comparison.panels import RLG_PT_compare_method
from addon.comparison.properties import MEASURES, RLG_comparison
from addon.properties import read, write
from blender_rl_guiding.comparison import Comparison
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.flat import flags
from blender_rl_guiding.images import read_exr, write_exr
from blender_rl_guiding.render import render
from blender_rl_guiding.schema import entries
from blender_rl_guiding.settings import BSDF, DQN, METHODS, PRESETS, RBF, QTable, Render, Uniform, method
from tests.addon.layout import context, drawn

from .conftest import Export

SMALL = QTable(recorded=3000, cells=4)


@pytest.fixture
def lit(scene: bpy.types.Scene, own_references: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[bpy.types.Scene]:
    """A cube under a grey world in a saved file, with a short comparison of three methods."""
    bpy.ops.mesh.primitive_cube_add(location=(0, 0, -4), rotation=(0.5, 0.4, 0.3))
    monkeypatch.setattr(environment, "python", lambda: Path(sys.executable))
    scene.render.engine = "RL_GUIDED"
    comparison = scene.rl_guiding_comparison
    for name, guide in (("uniform", Uniform()), ("plain", BSDF()), ("table", SMALL)):
        methods.add(comparison, name, Render(guide=guide))
    comparison.spp, comparison.reference_spp, comparison.use_probe = 4, 1, False
    (tmp_path / "é 你").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "é 你" / "cube.blend"))
    yield scene
    worker_client.end_all()


def pixels(image: bpy.types.Image) -> np.ndarray:
    """RGB, top row first."""
    return slots.pixels(image)[::-1, :, :3]


def test_a_comparison_comes_back_into_the_file_and_stays_there(lit: bpy.types.Scene, run: Export, tmp_path: Path):
    assert bpy.ops.rl_guided.compare() == {"FINISHED"}
    folder = tmp_path / "é 你" / "rl_guided" / "Scene" / "cube"
    runs = {path: path.stat().st_mtime_ns for path in folder.rglob("result.json")}
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    scene = bpy.context.scene
    comparison = scene.rl_guiding_comparison
    assert [item.name for item in comparison.results] == ["uniform", "plain", "table"]
    for item in comparison.results:
        expected = render(_exported(run, scene), Render(spp=4, guide=methods.settings_of(comparison.methods[item.name]).guide)).image
        np.testing.assert_array_equal(pixels(item.image), expected)
        metrics = json.loads((folder / item.name / "seed-0" / "result.json").read_text(encoding="utf-8"))["metrics"]
        np.testing.assert_allclose([getattr(item, name) for name in metrics], list(metrics.values()), rtol=1e-6)
        assert item.heat.size[:] == item.image.size[:]
        assert item.image.filepath.startswith("//rl_guided")
        assert item.seconds > 0
        assert item.samples_per_second > 0
    np.testing.assert_array_equal(pixels(comparison.reference_image), read_exr(folder / "reference.exr")[0])
    assert {"mape_display over samples per pixel", "relmse over seconds"} <= {item.name for item in comparison.pictures}
    assert Path(comparison.page).read_text(encoding="utf-8").startswith("<!doctype html>")
    assert len(bpy.data.scenes) == 1
    comparison.spp = 4
    assert bpy.ops.rl_guided.compare() == {"FINISHED"}  # the second time renders nothing, and adds no image
    assert {path: path.stat().st_mtime_ns for path in runs} == runs
    assert not [image.name for image in bpy.data.images if image.name.endswith(".001")]
    _slots_hold(scene, tmp_path)


def _exported(run: Export, scene: bpy.types.Scene):
    scene.render.engine = "RL_GUIDED_TEST"
    try:
        return run()
    finally:
        scene.render.engine = "RL_GUIDED"


def _slots_hold(scene: bpy.types.Scene, folder: Path) -> None:
    """All images are in slots of the same names, bit for bit. The render settings are again those of the user."""
    before = {name: getattr(scene.render, name) for name in ("engine", "resolution_x", "resolution_percentage", "use_compositing")}
    assert bpy.ops.rl_guided.to_slots() == {"FINISHED"}
    assert {name: getattr(scene.render, name) for name in before} == before
    result, comparison = slots.result(), scene.rl_guiding_comparison
    assert result
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    for name, image in {"reference": comparison.reference_image, **{item.name: item.image for item in comparison.results}}.items():
        result.render_slots.active_index = [slot.name for slot in result.render_slots].index(name)
        result.save_render(str(folder / "slot.exr"))
        np.testing.assert_array_equal(read_exr(folder / "slot.exr")[0], pixels(image), err_msg=name)


def test_a_reference_from_a_file_has_to_fit(lit: bpy.types.Scene, tmp_path: Path):
    comparison = lit.rl_guiding_comparison
    comparison.reference, comparison.reference_file = "FILE", str(tmp_path / "none.exr")
    with pytest.raises(RuntimeError, match=r"the reference is not at .*none\.exr"):
        bpy.ops.rl_guided.compare()
    write_exr(tmp_path / "grey.exr", np.ones((8, 9, 3), np.float32), {})
    comparison.reference_file = str(tmp_path / "grey.exr")
    with pytest.raises(RuntimeError, match="is 9 x 8 pixels, but scene 'cube' renders 16 x 16"):
        bpy.ops.rl_guided.compare()


def test_what_cannot_be_compared_is_a_line(lit: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch):
    comparison = lit.rl_guiding_comparison
    comparison.methods[1].name = "uniform"
    with pytest.raises(RuntimeError, match="two methods are called 'uniform'"):
        bpy.ops.rl_guided.compare()
    comparison.methods[1].name = "plain"
    comparison.folder = bpy.data.filepath
    with pytest.raises(RuntimeError, match=r"cube\.blend is not a folder"):
        bpy.ops.rl_guided.compare()
    comparison.folder = "//rl_guided/"
    comparison.reference, comparison.methods[0].settings.max_bounces = "CYCLES", 3
    with pytest.raises(RuntimeError, match="Cycles takes the scene's own path lengths"):
        bpy.ops.rl_guided.compare()
    comparison.methods.clear()
    with pytest.raises(RuntimeError, match="there is no method"):
        bpy.ops.rl_guided.compare()


def test_an_unsaved_file_needs_a_folder(scene: bpy.types.Scene):
    with pytest.raises(InputError, match="save it first"):
        operators.folder_of(scene)


def test_the_budget_is_that_of_the_comparison(scene: bpy.types.Scene):
    comparison = scene.rl_guiding_comparison
    methods.add(comparison, "a", Render(spp=7, seconds=3.0))
    comparison.spp = 5
    assert read(comparison, Comparison).compared() == {"a": Render(spp=5)}
    comparison.budget, comparison.seconds = "SECONDS", 0.3
    assert read(comparison, Comparison).compared() == {"a": Render(spp=1_000_000, seconds=0.3)}


def test_methods_come_from_presets_guides_and_the_scene(scene: bpy.types.Scene):
    comparison = scene.rl_guiding_comparison
    for name in METHODS:
        assert bpy.ops.rl_guided.method_add(name=name) == {"FINISHED"}
        assert methods.settings_of(comparison.methods[-1]) == method(name)
    assert set(PRESETS) < set(METHODS)
    write(scene.rl_guiding, Render(nee=True, guide=DQN(width=7)))
    bpy.ops.rl_guided.method_add()
    assert comparison.methods[-1].name == "dqn 2"
    assert methods.settings_of(comparison.methods[-1]) == Render(nee=True, guide=DQN(width=7))


def test_the_list_can_be_edited(scene: bpy.types.Scene):
    comparison = scene.rl_guiding_comparison
    for name in ("uniform", "dqn"):
        bpy.ops.rl_guided.method_add(name=name)
    bpy.ops.rl_guided.method_move(step=-1)
    bpy.ops.rl_guided.method_move(step=-1)
    bpy.ops.rl_guided.method_duplicate()
    assert [item.name for item in comparison.methods] == ["dqn", "uniform", "dqn 2"]
    comparison.methods[2].settings.guide_dqn.width = 5
    bpy.ops.rl_guided.method_apply()
    assert scene.rl_guiding.guide_dqn.width == 5
    bpy.ops.rl_guided.method_remove()
    assert [item.name for item in comparison.methods] == ["dqn", "uniform"]
    assert comparison.active_method == 1
    for _ in range(2):
        bpy.ops.rl_guided.method_remove()
    assert not bpy.ops.rl_guided.method_remove.poll()


def test_a_sweep_varies_one_setting(scene: bpy.types.Scene):
    comparison = scene.rl_guiding_comparison
    bpy.ops.rl_guided.method_add(name="dqn")
    bpy.ops.rl_guided.method_sweep(setting="dqn.width", values="8, 16,")
    bpy.ops.rl_guided.method_sweep(setting="nee", values="on")
    assert {item.name: methods.settings_of(item) for item in comparison.methods} == {
        "dqn": Render(nee=False, guide=DQN()),
        "dqn width 8": Render(nee=False, guide=DQN(width=8)),
        "dqn width 16": Render(nee=False, guide=DQN(width=16)),
        "dqn width 16 nee on": Render(nee=True, guide=DQN(width=16)),
    }
    with pytest.raises(RuntimeError, match="Width cannot be '0'"):
        bpy.ops.rl_guided.method_sweep(setting="dqn.width", values="8, 0")
    assert len(comparison.methods) == 4


def test_the_example_of_every_setting_can_be_swept():
    settings = Render(guide=DQN())
    for name, _, _ in methods.sweepable(settings):
        entry = dict(flags(Render))[name]
        if entry.type is not float or entry.limits[0] != 0:
            assert list(methods.sweep(settings, name, methods.example(settings, name))), name


def test_a_choice_of_another_version_is_reported(scene: bpy.types.Scene):
    comparison = scene.rl_guiding_comparison
    methods.add(comparison, "old", Render(guide=DQN(encoder=method("slides_b_rbf").guide.encoder)))
    group = comparison.methods[0].settings.guide_dqn
    if bpy.app.version >= (5, 0):
        group.bl_system_properties_get()["encoder"] = 12345
    else:
        group["encoder"] = 12345
    with pytest.raises(InputError, match=r"method 'old': its Encoder was chosen in another version"):
        read(comparison, Comparison)
    assert "encoder" in drawn(RLG_PT_compare_method, context(scene)).names, "or it could not be chosen again"


def test_a_number_beyond_the_limits_of_this_version_is_reported(scene: bpy.types.Scene):
    comparison = scene.rl_guiding_comparison
    methods.add(comparison, "old", Render(guide=DQN()))
    group = comparison.methods[0].settings.guide_dqn
    if bpy.app.version >= (5, 0):
        group.bl_system_properties_get()["batch"] = -3
    else:
        group["batch"] = -3
    with pytest.raises(InputError, match=r"method 'old': .*batch=-3 is out of range"):
        read(comparison, Comparison)


def test_menus_are_saved_by_numbers_that_never_change(scene: bpy.types.Scene):
    menus = RLG_comparison.bl_rna.properties
    assert [(item.identifier, item.value) for item in menus["budget"].enum_items] == [("SAMPLES", 0), ("SECONDS", 1)]
    assert [(item.identifier, item.value) for item in menus["reference"].enum_items] == [("OWN", 0), ("CYCLES", 1), ("FILE", 2)]
    assert [(item[0], item[3]) for item in MEASURES[:4]] == [("mape_display", 0), ("mape", 1), ("relmse", 2), ("flip", 3)]
    assert workspace.NAME == "Compare"


OLD = Path(__file__).with_name("comparison-0.1.blend")  # saved by Blender 4.5, before the properties were made from `Comparison`


def test_a_file_of_an_earlier_version_has_its_comparisons(exported: list):
    bpy.ops.wm.open_mainfile(filepath=str(OLD))
    network = Render(spp=7, seconds=2.5, seed=5, guide=DQN(width=48, encoder=RBF(sigma=0.3)))
    first = Comparison(
        methods=(("uniform", Render(nee=False, guide=Uniform())), ("network é", network)),
        budget="SECONDS",
        spp=48,
        seconds=12.5,
        seeds=3,
        reference="FILE",
        reference_spp=2048,
        reference_file=OLD.with_name("truth.exr"),
        probe=(6, 9),
    )
    saved, other, untouched = (bpy.data.scenes[name].rl_guiding_comparison for name in ("Scene", "Other", "Untouched"))
    assert read(saved, Comparison) == first
    assert read(other, Comparison) == replace(first, budget="SAMPLES", reference="CYCLES", use_probe=False)
    assert (saved.folder, saved.measure, other.measure, saved.active_method) == ("//runs/", "relmse", "flip", 1)
    assert [(item.name, item.mape, item.seeds) for item in saved.results] == [("uniform", 0.5, 3)]
    assert (saved.about, saved.page) == ("2048 samples per pixel or more", "//runs/Scene/report.html")
    untouched.methods.add().name = "plain"
    assert read(untouched, Comparison) == Comparison((("plain", Render()),)), "defaults are those of the class"


def test_the_help_of_the_panel_is_that_of_the_class(scene: bpy.types.Scene):
    for entry in entries(Comparison):
        shown = RLG_comparison.bl_rna.properties[entry.name]
        if not entry.of:
            assert (shown.name, shown.description) == (entry.label, entry.doc.rstrip("."))


def test_commands_give_the_bits_of_the_panel(lit: bpy.types.Scene, run: Export, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    settings = Render(spp=3, guide=SMALL)
    write(lit.rl_guiding, settings)
    expected = render(_exported(run, lit), settings).image
    bpy.ops.wm.save_mainfile()
    blend = bpy.data.filepath
    assert commands.main(["render", blend, "--out", str(tmp_path / "a")]) == 0
    np.testing.assert_array_equal(read_exr(tmp_path / "a" / "image.exr")[0], expected)
    assert commands.main(["export", blend, str(tmp_path / "cube.npz"), "--strict"]) == 0
    compared = ["--methods", "uniform,bsdf", "--spp", "2", "--reference-spp", "1", "--max-bounces", "2"]
    assert commands.main(["compare", blend, "--out", str(tmp_path / "b"), *compared]) == 0
    assert (tmp_path / "b" / "report.html").exists()
    assert commands.main(["compare", blend, "--out", str(tmp_path / "c"), "--seeds", "2"]) == 0
    runs = [path.parent for path in (tmp_path / "c").rglob("result.json")]
    assert {(run.parent.name, run.name) for run in runs} == {*product(("uniform", "plain", "table"), ("seed-0", "seed-1"))}
    capsys.readouterr()
    for flag, value in (("--reference", "a.exr"), ("--spp", "3")):
        assert commands.main(["compare", blend, "--out", str(tmp_path / "d"), flag, value]) == 2
        assert f"{flag[2:]} needs --methods" in capsys.readouterr().err
    assert commands.main(["render", str(tmp_path / "none.blend"), "--out", str(tmp_path / "d")]) == 2
    assert "none.blend" in capsys.readouterr().err
    assert commands.main(["render", blend, "--out", str(tmp_path / "d"), "--sp", "3"]) == 2
    assert not os.path.exists(tmp_path / "d")
