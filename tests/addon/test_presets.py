"""Presets, both built-in ones and the user's: applying one is a single undo step, and other settings stay."""

import json
from pathlib import Path

import bpy
import pytest

from addon import presets
from addon.properties import read, write
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.flat import override
from blender_rl_guiding.schema import to_dict
from blender_rl_guiding.settings import DQN, PRESETS, QTable, Render
from tests.addon.layout import Layout, context

MINE = Render(spp=512, seed=7, guide=DQN(width=31))


@pytest.fixture
def folder(scene: bpy.types.Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder for the user's presets."""
    monkeypatch.setattr(bpy.utils, "user_resource", lambda kind, path: str(tmp_path / kind / path))
    return tmp_path / "SCRIPTS" / "presets" / "rl_guided"


def test_presets_are_about_the_method_alone():
    assert presets.subjects() == {"guide", "nee", "emphasis"}


@pytest.mark.parametrize("name", PRESETS)
def test_a_built_in_preset(scene: bpy.types.Scene, name: str):
    write(scene.rl_guiding, Render(spp=99, seed=3, denoise=True, emphasis=2.0, nee=True))
    presets.apply(scene, name)
    assert read(scene.rl_guiding, Render) == override(PRESETS[name].settings, {"spp": 99, "seed": 3, "denoise": True})
    assert PRESETS[name].doc.endswith(".")


def test_variants_that_are_not_chosen_keep_their_values(scene: bpy.types.Scene):
    write(scene.rl_guiding, MINE)
    presets.apply(scene, "recommended")
    assert read(scene.rl_guiding, Render).guide == QTable()
    scene.rl_guiding.guide = "dqn"
    assert read(scene.rl_guiding, Render).guide == MINE.guide


def test_applying_is_one_step_to_undo(scene: bpy.types.Scene):
    write(scene.rl_guiding, MINE)
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.rl_guided.preset_apply("EXEC_DEFAULT", True, name="slides_c_rbf")
    assert read(bpy.context.scene.rl_guiding, Render).guide == PRESETS["slides_c_rbf"].settings.guide
    bpy.ops.ed.undo()
    assert read(bpy.context.scene.rl_guiding, Render) == MINE


def test_the_users_own(scene: bpy.types.Scene, folder: Path):
    write(scene.rl_guiding, MINE)
    assert bpy.ops.rl_guided.preset_add(name="Für Küche 2") == {"FINISHED"}
    (path,) = presets.files()
    assert path.parent == folder
    assert json.loads(path.read_text(encoding="utf-8")) == to_dict(MINE)
    write(scene.rl_guiding, Render())
    assert bpy.ops.rl_guided.preset_load(filepath=str(path)) == {"FINISHED"}
    assert read(scene.rl_guiding, Render) == MINE
    assert bpy.ops.rl_guided.preset_remove(name=path.stem) == {"FINISHED"}
    assert presets.files() == []


def test_the_menu_lists_both(scene: bpy.types.Scene, folder: Path):
    presets.add(scene, "Night shots")
    layout = Layout()
    menu = type("Menu", (), {"layout": layout, "_draw_own": presets.RLG_PT_presets._draw_own})()
    presets.RLG_PT_presets.draw(menu, context(scene))
    assert layout.texts == [*(preset.label for preset in PRESETS.values()), "Night shots", "", ""]


def test_faults_are_told(scene: bpy.types.Scene, folder: Path):
    presets.add(scene, "one")
    with pytest.raises(InputError, match=r"^there is a preset 'one' already$"):
        presets.add(scene, "one")
    with pytest.raises(InputError, match=r"^a preset needs a name$"):
        presets.add(scene, "  ")
    with pytest.raises(InputError, match=r"^cannot remove .*two\.json: No such file or directory$"):
        presets.remove("two")
    (folder / "one.json").write_text('{"sppp": 3}')
    with pytest.raises(RuntimeError, match=r"one\.json: render has no setting 'sppp'; did you mean 'spp'\?"):
        bpy.ops.rl_guided.preset_load(filepath=str(folder / "one.json"))
    with pytest.raises(RuntimeError, match="no preset is called 'three'"):
        bpy.ops.rl_guided.preset_apply(name="three")


def test_a_folder_that_cannot_be_written(scene: bpy.types.Scene, folder: Path):
    folder.parent.mkdir(parents=True)
    folder.write_text("in the way")
    with pytest.raises(InputError, match=r"^cannot write .*one\.json: "):
        presets.add(scene, "one")
