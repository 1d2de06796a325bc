"""Ctrl-C ends a command long before its work is done. Each file is then complete or missing."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from blender_rl_guiding.images import read_exr
from blender_rl_guiding.render import render
from blender_rl_guiding.scene.bundle import load, save
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.settings import DQN, Machine, Render, Uniform
from tests import scenes

C1 = Path(__file__).resolve().parents[2] / "scenes" / "c1.blend"
TRACING, LEARNING = "render.renderer:PassTracer:trace", "guiding.dqn:DQNGuide:learn"
LONG_LEARNING = ["--guide", "dqn", "--dqn.learning-starts", "64", "--dqn.first-steps", "5", "--dqn.steps", "100000"]


@pytest.fixture
def large(tmp_path: Path) -> Path:
    """A scene with slow passes."""
    save(scenes.tiny(300), tmp_path / "tiny.npz")
    return tmp_path / "tiny.npz"


def everything(folder: Path) -> set[str]:
    return {path.name for path in folder.rglob("*")}


def assert_whole(out: Path, scene: SceneData, settings: Render) -> None:
    """Assert that each pixel has its samples of all complete passes, and either all or none of the interrupted pass."""
    assert everything(out) == {"image.exr", "image.png", "result.json"}
    result = json.loads((out / "result.json").read_text())
    assert result["finished"] is False
    whole = result["curve"][-1]["samples"]
    assert 0 < whole <= result["spp"] < settings.spp
    image = read_exr(out / "image.exr")[0]
    before, after = (render(scene, replace(settings, spp=spp), Machine()).image for spp in (whole, result["spp"]))
    assert ((image == before).all(axis=2) | (image == after).all(axis=2)).all()


def test_while_rendering_it_keeps_the_finished_samples(interrupted, large, tmp_path):
    flags = ["--spp", 1000, "--guide", "uniform", "--seconds", 1000]  # a time limit makes passes short, so the test's own renders are short
    status, said = interrupted(TRACING, 5, "render", large, "--out", tmp_path / "out", *flags)  # three of the passes are the warm-up's
    assert status == 130, said
    assert_whole(tmp_path / "out", load(large), Render(spp=1000, guide=Uniform(), seconds=1000.0))
    assert said.splitlines()[-1].startswith("rlg: interrupted after ")


def test_while_rendering_the_first_pass_it_leaves_nothing(interrupted, large, tmp_path):
    status, said = interrupted(TRACING, 2, "render", large, "--out", tmp_path / "out", "--spp", 1000)
    assert status == 130, said
    assert everything(tmp_path) == {"tiny.npz"}
    assert said.splitlines()[-1] == "rlg: interrupted after 0 of 1000 samples"


@pytest.mark.parametrize("after", [0.02, 0.5])
def test_while_learning_it_keeps_the_finished_samples(interrupted, bundle, tmp_path, after):
    arguments = ["render", bundle, "--out", tmp_path / "out", "--spp", 1000, *LONG_LEARNING]
    status, said = interrupted(LEARNING, 4, *arguments, after=after)  # two of the calls are the warm-up's
    assert status == 130, said
    guide = DQN(learning_starts=64, first_steps=5, steps=100000)
    assert_whole(tmp_path / "out", load(bundle), Render(spp=1000, guide=guide))


@pytest.mark.parametrize(
    ("moment", "scene"),
    [("opening.blend::load", "tiny.npz"), ("render.renderer::_tiny_scene", "tiny.npz"), ("render.renderer::_tiny_scene", C1)],
)
def test_while_opening_and_compiling_it_leaves_nothing(interrupted, bundle, tmp_path, monkeypatch, moment, scene):
    monkeypatch.setenv("TMPDIR", str(tmp_path))  # the export writes there
    status, said = interrupted(moment, 1, "render", tmp_path / scene, "--out", tmp_path / "out", after=0.01)
    assert status == 130, said
    assert everything(tmp_path) == {"tiny.npz"}
    assert said.splitlines()[-1].startswith("rlg: interrupted")


@pytest.mark.parametrize("after", [0.1, 0.5])
def test_while_exporting_it_leaves_nothing(interrupted, tmp_path, after):
    arguments = ["export", C1, tmp_path / "c1.npz"]
    status, said = interrupted("opening.blend::_coverage", 1, *arguments, after=after)
    assert status == 130, said
    assert everything(tmp_path) == set()
    assert said.splitlines()[-1] == "rlg: interrupted"


def test_with_jobs_all_processes_end(interrupted, bundle, tmp_path):
    """The fixture also waits for the children, because they have the command's stderr."""
    command = ["compare", bundle, "--methods", "dqn", "--seeds", 2, "--spp", 1000, "--reference-spp", 1, "--jobs", 2, *LONG_LEARNING[2:]]
    moment = "experiments.forecast:Forecast:go"
    status, said = interrupted(moment, 2, *command, "--out", tmp_path / "out", after=0.3, group=True)
    assert status == 130, said
    assert said.splitlines()[-1] == "rlg: interrupted"
    assert "Traceback" not in said
    assert everything(tmp_path / "out") == {"experiment.json", "tiny", "reference.exr", "probe.json"}
