"""`rlg inspect`, and the pictures of Q in comparisons."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from blender_rl_guiding.images import read_exr
from blender_rl_guiding.scene.bundle import save
from tests import scenes
from tests.system.small import SMALL

CELLS = {kind: [f"--{kind}.cells", 3] for kind in ("qtable", "dqn")}  # few cells, so that a small image shows all of them
TABLE = ["--guide", "qtable", "--qtable.rows", 3, "--qtable.columns", 4, *CELLS["qtable"]]
NETWORK = ["--guide", "dqn", *SMALL, *CELLS["dqn"]]


def result(folder: Path) -> dict:
    return json.loads((folder / "result.json").read_text())


def pixels(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.array(image)


@pytest.mark.parametrize("guide", [TABLE, NETWORK], ids=["qtable", "dqn"])
def test_inspect_renders_and_shows_what_is_learnt(rlg, bundle, tmp_path, guide):
    out = tmp_path / "out"
    done = rlg("inspect", bundle, "--out", out, "--spp", 4, *guide, "--pixel", 6, 11)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [str(out / name) for name in ("image.exr", "states.png", "q.png")]
    assert {path.name for path in out.iterdir()} == {"image.exr", "image.png", "result.json", "states.png", "q.png"}
    assert result(out)["probe"].items() >= {"pixel": [6, 11], "rows": 3, "columns": 4}.items()
    assert rlg("render", bundle, "--out", tmp_path / "plain", "--spp", 4, *guide).returncode == 0
    np.testing.assert_array_equal(read_exr(out / "image.exr")[0], read_exr(tmp_path / "plain" / "image.exr")[0])
    assert result(tmp_path / "plain")["probe"] is None
    states = pixels(out / "states.png")
    assert states.shape == (12, 12, 3)
    assert len(np.unique(states.reshape(-1, 3), axis=0)) > 20
    assert pixels(out / "q.png").shape[1] > 1000


def test_a_guide_that_has_not_begun_to_learn_shows_the_truth_alone(rlg, bundle, tmp_path):
    assert rlg("inspect", bundle, "--out", tmp_path / "out", "--spp", 1, *TABLE).returncode == 0
    assert result(tmp_path / "out")["probe"] is None
    assert pixels(tmp_path / "out" / "q.png").shape[1] < 1000


def test_a_pixel_without_a_surface_is_refused_before_rendering(rlg, tmp_path):
    save(scenes.lit_quad(scenes.look((0, -1, 0), (0, 0, 0), 40, 8, 8)), tmp_path / "quad.npz")
    done = rlg("inspect", tmp_path / "quad.npz", "--out", tmp_path / "out", *TABLE, "--pixel", 4, 4)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.splitlines()[-1].startswith("rlg: pixel (4, 4) of scene 'test' sees no surface that reflects")
    assert not (tmp_path / "out").exists()


COMPARE = ["--methods", "uniform,qtable,dqn", "--spp", 4, "--reference-spp", 1, *SMALL, *CELLS["qtable"], *CELLS["dqn"]]


def test_a_comparison_shows_what_is_learnt_and_done_runs_keep_it(rlg, bundle, tmp_path):
    out = tmp_path / "out"
    assert rlg("compare", bundle, *COMPARE, "--out", out, "--probe", 6, 10).returncode == 0
    probes = {method: result(out / "tiny" / method / "seed-0")["probe"] for method in ("uniform", "qtable", "dqn")}
    assert probes["uniform"] is None
    assert [(probes[m]["pixel"], probes[m]["rows"], len(probes[m]["q"])) for m in ("qtable", "dqn")] == [
        ([6, 10], 15, 360),
        ([6, 10], 3, 12),
    ]
    truth = (out / "tiny" / "probe.json").read_text()
    assert json.loads(truth)["pixel"] == [6, 10]
    assert (out / "report.html").read_text().count("<img class=disc ") == 3
    assert (out / "figures" / "learnt-tiny.pdf").exists()
    again = rlg("compare", bundle, *COMPARE, "--out", out, "--probe", 6, 10)
    assert again.stderr.count("done before") == 3
    assert result(out / "tiny" / "dqn" / "seed-0")["probe"] == probes["dqn"]
    assert (out / "tiny" / "probe.json").read_text() == truth
    moved = rlg("compare", bundle, *COMPARE, "--out", out, "--probe", 2, 10)
    assert moved.stderr.count("done before") == 3
    page = (out / "report.html").read_text()
    assert page.count("<img class=disc ") == 1
    assert "No picture of qtable and dqn" in page


def test_without_anything_to_probe_there_is_a_note_or_nothing(rlg, bundle, tmp_path):
    done = rlg("compare", bundle, *COMPARE, "--out", tmp_path / "lamp", "--probe", 5, 1)
    assert done.returncode == 0
    assert "tiny: pixel (5, 1) sees no surface that reflects" in done.stderr
    assert rlg("compare", bundle, "--methods", "bsdf", "--spp", 1, "--reference-spp", 1, "--out", tmp_path / "fixed").returncode == 0
    for out in ("lamp", "fixed"):
        assert not (tmp_path / out / "tiny" / "probe.json").exists()
        assert "What is learnt" not in (tmp_path / out / "report.html").read_text()
