"""`produce` makes a run: it goes on from the checkpoint, computes errors, saves the run, and reports progress."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blender_rl_guiding import cache
from blender_rl_guiding.experiments import produce as module
from blender_rl_guiding.experiments.probe import find
from blender_rl_guiding.experiments.produce import produce
from blender_rl_guiding.experiments.runs import Frame, Judge, Task
from blender_rl_guiding.images.metrics import compare
from blender_rl_guiding.pace import Pace
from blender_rl_guiding.render import Result, checkpoint, render
from blender_rl_guiding.report import result_file
from blender_rl_guiding.scene.description import IDENTITY, Lamp
from blender_rl_guiding.settings import Machine, QTable, Render
from tests import scenes

SCENE, MACHINE = scenes.tiny(8), Machine()
SETTINGS = Render(spp=4, guide=QTable(rows=2, columns=4, cells=4, recorded=500))
OFTEN = Machine(checkpoint=1e-9)


@pytest.fixture(autouse=True)
def _own_cache(own_references: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keeps references out of the user's cache. With the machine OFTEN, a checkpoint is written before every pass."""
    monkeypatch.setattr(checkpoint, "SHARE", 0)


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def kept() -> list[Path]:
    """The checkpoints of renders without a folder."""
    folder = cache.folder("checkpoints")
    return [*folder.iterdir()] if folder else []


class Stop:
    """Presses Ctrl-C after a number of passes."""

    def __init__(self, passes: int) -> None:
        self._passes = passes

    def __call__(self, state: Result, pace: Pace) -> None:
        self._passes -= 1
        if not self._passes:
            raise KeyboardInterrupt


def test_a_run_is_rendered_and_saved(tmp_path: Path):
    paces: list[Pace] = []
    passes: list[tuple[int, Pace]] = []
    task = Task(tmp_path, SCENE, SETTINGS)
    result = produce(task, MACHINE, paces.append, lambda state, pace: passes.append((state.taken, pace)))
    np.testing.assert_array_equal(result.image, render(SCENE, SETTINGS).image)
    record = result_file.read(tmp_path / "result.json")
    assert names(tmp_path) == {"image.exr", "image.png", "result.json"}
    assert (record.method, record.spp, record.finished, record.metrics, record.probe) == ("qtable", 4, True, None, None)
    assert [taken for taken, _ in passes] == [1, 2, 3, 4]
    assert passes[-1][1] == paces[-1] == Pace(result.seconds, 0.0)
    assert all(0 < pace.share <= 1 for pace in paces)


def test_with_a_reference_each_pass_is_judged_and_with_a_point_the_guide_is_asked(tmp_path: Path):
    judge, point = Judge(np.ones((8, 8, 3), np.float32), "key"), find(SCENE, (4, 7), MACHINE)
    result = produce(Task(tmp_path, SCENE, SETTINGS, "mine", judge, point), MACHINE)
    record = result_file.read(tmp_path / "result.json")
    assert (record.method, record.judged_by, record.metrics) == ("mine", "key", compare(result.image, judge.truth))
    assert all({"mape_display", "relmse"} <= entry.keys() for entry in record.curve)
    assert record.probe
    assert (record.probe.pixel, record.probe.rows, record.probe.columns) == ((4, 7), 2, 4)


def test_a_frame_has_a_number(tmp_path: Path):
    produce(Task(tmp_path, SCENE, Render(spp=1), frame=Frame(7, "file")), MACHINE)
    record = result_file.read(tmp_path / "result-0007.json")
    assert names(tmp_path) == {"image-0007.exr", "image-0007.png", "result-0007.json"}
    assert (record.frame, record.source) == (7, "file")


@pytest.mark.parametrize("judge", [None, Judge(np.ones((8, 8, 3), np.float32), "key")], ids=["alone", "judged"])
def test_interrupted_it_keeps_the_finished_samples_and_goes_on(judge: Judge | None, tmp_path: Path, notes: list[str]):
    task = Task(tmp_path, SCENE, SETTINGS, judge=judge, keeps_unfinished=True)
    with pytest.raises(KeyboardInterrupt, match=r"^interrupted after 3 of 4 samples; the same command goes on from sample 2$"):
        produce(task, OFTEN, on_pass=Stop(3))
    record = result_file.read(tmp_path / "result.json")
    assert (record.spp, record.finished) == (3, False)
    result = produce(task, OFTEN)
    assert f"goes on from {tmp_path / 'checkpoint.npz'}, after 2 of 4 samples" in notes
    np.testing.assert_array_equal(result.image, render(SCENE, SETTINGS).image)
    assert names(tmp_path) == {"image.exr", "image.png", "result.json"}


def test_interrupted_a_run_of_a_comparison_leaves_its_checkpoint_alone(tmp_path: Path):
    with pytest.raises(KeyboardInterrupt, match=r"^$"):
        produce(Task(tmp_path, SCENE, SETTINGS), OFTEN, on_pass=Stop(3))
    assert names(tmp_path) == {"checkpoint.npz"}


def test_without_a_folder_nothing_is_saved_and_the_checkpoint_is_in_the_cache(notes: list[str]):
    task = Task(None, SCENE, SETTINGS)
    with pytest.raises(KeyboardInterrupt):
        produce(task, OFTEN, on_pass=Stop(2))
    (file,) = kept()
    there: list[bool] = []
    produce(task, OFTEN, on_end=lambda result: there.append(file.exists()))
    assert notes == [f"goes on from {file}, after 1 of 4 samples"]
    assert (there, kept()) == ([True], [])  # the checkpoint exists until the image is handed over


def test_lamps_left_to_chance_are_told_unless_the_caller_or_blender_did(tmp_path: Path, notes: list[str]):
    lit = replace(SCENE, lamps=(Lamp("Bulb", "point", IDENTITY, (1.0, 1.0, 1.0), radius=0.001),))
    blind = Render(spp=1, nee=False)
    produce(Task(tmp_path, lit, blind, forewarned=True), MACHINE)
    produce(Task(None, lit, blind), MACHINE)
    assert notes == []
    produce(Task(tmp_path, lit, blind), MACHINE)
    assert len(notes) == 1
    assert notes[0].startswith("'Bulb': ")


def test_memory_is_asked_before_anything_is_rendered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    asked: list[str] = []
    monkeypatch.setattr(module, "forewarn", lambda *_: asked.append("all"))
    monkeypatch.setattr(module, "forewarn_of_memory", lambda *_: asked.append("memory"))
    monkeypatch.setattr(module, "render", lambda *_: pytest.fail("rendered") if not asked else render(*_))
    for task in (Task(tmp_path, SCENE, Render(spp=1)), Task(None, SCENE, Render(spp=1))):
        produce(task, MACHINE)
    assert asked == ["all", "memory"]
