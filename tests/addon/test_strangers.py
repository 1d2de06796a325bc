"""Paths in a .blend from a stranger: the add-on writes and opens no file in a place that the user does not expect."""

import sys
from pathlib import Path

import bpy
import pytest

from addon import installation as environment
from addon.comparison import methods, operators, show_operators
from addon.comparison.properties import CHOSEN
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.settings import QTable, Render


@pytest.fixture
def comparison(scene: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> bpy.types.PropertyGroup:
    """The comparison of a saved file. Any render fails the test."""
    monkeypatch.setattr(environment, "python", lambda: Path(sys.executable))
    monkeypatch.setattr(operators, "working", lambda *_: pytest.fail("it begins to work"))
    methods.add(scene.rl_guiding_comparison, "table", Render(guide=QTable()))
    (tmp_path / "own").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "own" / "file.blend"))
    return scene.rl_guiding_comparison


BAD = ("/tmp/x", "../x", "../../x", "a/b", "a\\b", "..", ".", "", "a\n", "\x1b[31m", "x" * 200, "C:", "a ", "//x")


@pytest.mark.parametrize("name", BAD)
def test_a_method_is_called_as_a_folder_can_be(name: str, comparison: bpy.types.PropertyGroup):
    comparison.methods[0].name = name
    for operator in (bpy.ops.rl_guided.inspect, bpy.ops.rl_guided.compare):
        with pytest.raises(RuntimeError, match=r"method '.*: rename it"):
            operator()


@pytest.mark.parametrize("folder", ["//..", "//../other", "/tmp/other", "/", "//link/in", "//inside/../../other"])
def test_results_stay_in_the_folder_of_the_blend(folder: str, comparison: bpy.types.PropertyGroup, tmp_path: Path):
    (tmp_path / "own" / "link").symlink_to(tmp_path)
    comparison.folder = folder
    assert operators.all_folders_of(comparison), "the user has chosen it"
    CHOSEN.clear()  # as after opening the file in another Blender
    for operator in (bpy.ops.rl_guided.inspect, bpy.ops.rl_guided.compare):
        with pytest.raises(RuntimeError, match=r"outside of its own folder: if that is right, choose this folder again"):
            operator()
    comparison.folder = comparison.folder
    assert operators.folder_of(bpy.context.scene).name == "Scene"


@pytest.mark.parametrize("folder", ["//", "//rl_guided/", "//a/../b", ""])
def test_there_they_need_no_choice(folder: str, comparison: bpy.types.PropertyGroup, tmp_path: Path):
    comparison.folder = folder
    CHOSEN.clear()
    assert operators.folder_of(bpy.context.scene).is_relative_to(tmp_path / "own")


@pytest.mark.parametrize(
    "page",
    ["../report.html", "rl_guided/evil.html", "rl_guided/report.desktop", "report.html", "rl_guided/link/report.html", "rl_guided"],
)
def test_only_a_report_is_opened(page: str, comparison: bpy.types.PropertyGroup, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    folder, opened = tmp_path / "own" / "rl_guided", []
    (folder / "Scene").mkdir(parents=True)
    (folder / "link").symlink_to(tmp_path)
    for name in ("report.html", "evil.html", "report.desktop", "Scene/report.html", "../report.html", "../../report.html"):
        (folder / name).touch()
    monkeypatch.setattr(show_operators, "_browse", opened.append)
    comparison.results.add()
    comparison.page = str(tmp_path / "own" / page)
    with pytest.raises(RuntimeError, match="is no report in the folder of the comparison"):
        bpy.ops.rl_guided.open_report()
    assert not opened
    comparison.page = str(folder / "Scene" / "report.html")
    assert bpy.ops.rl_guided.open_report() == {"FINISHED"}
    assert opened == [folder / "Scene" / "report.html"]
    (folder / "Scene" / "report.html").unlink()
    with pytest.raises(RuntimeError, match=r"is not at .* any more"):
        bpy.ops.rl_guided.open_report()


def test_an_active_method_that_there_is_not(comparison: bpy.types.PropertyGroup, monkeypatch: pytest.MonkeyPatch):
    asked = []

    def working(*arguments: object):
        asked.append(arguments[2]("a.npz"))
        raise InputError("enough")

    monkeypatch.setattr(operators, "working", working)
    for active in (-7, 7):
        comparison.active_method = active
        with pytest.raises(RuntimeError, match="enough"):
            bpy.ops.rl_guided.inspect()
    assert [Path(job.out).name for job in asked] == ["table", "table"]
