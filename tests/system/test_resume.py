"""An interrupted comparison keeps its finished runs, goes on from there, and ends in the same numbers."""

import csv
import os
from dataclasses import replace
from pathlib import Path

import pytest

from blender_rl_guiding.experiments.results import COLUMNS
from blender_rl_guiding.scene.bundle import save
from tests import scenes
from tests.system.small import SMALL

TIMES = {"seconds", "learn_seconds", "train_seconds", "infer_seconds"}
COMPARE = ["--methods", "uniform,dqn", "--spp", "8", "--seeds", "2", "--reference-spp", "256", *SMALL]


def table(out: Path) -> list[dict[str, str]]:
    """The rows of table.csv without what a clock decides."""
    with (out / "table.csv").open() as file:
        return [{name: value for name, value in row.items() if name not in TIMES} for row in csv.DictReader(file)]


def finished(out: Path) -> dict[str, int]:
    """When each finished run was written."""
    return {str(path.parent.relative_to(out)): os.stat(path).st_mtime_ns for path in out.rglob("result.json")}


def test_an_interrupted_comparison_goes_on(rlg, interrupted, bundle, tmp_path):
    assert rlg("compare", bundle, *COMPARE, "--out", tmp_path / "whole").returncode == 0
    out = tmp_path / "cut"
    status, said = interrupted("experiments.tasks::save_run", 3, "compare", bundle, *COMPARE, "--out", out, after=0)
    assert status == 130, said
    assert said.splitlines()[-1] == "rlg: interrupted"
    before = finished(out)
    assert 2 <= len(before) < 4
    assert not (out / "report.html").exists()
    assert not list(out.rglob(".*")), "temporary files"
    again = rlg("compare", bundle, *COMPARE, "--out", out)
    assert again.returncode == 0
    assert again.stderr.count("done before") == len(before)
    after = finished(out)
    assert len(after) == 4
    assert {run: after[run] for run in before} == before
    assert table(out) == table(tmp_path / "whole")
    assert set(table(out)[0]) == set(COLUMNS) - TIMES


def test_an_interrupted_reference_goes_on(rlg, interrupted, bundle, tmp_path):
    out = tmp_path / "out"
    command = ["compare", bundle, "--methods", "bsdf", "--spp", 1, "--reference-spp", 384, "--max-bounces", 3, "--out", out]
    status, _ = interrupted("experiments.references::write_exr", 2, *command, after=0)
    assert status == 130
    blocks = list((Path(os.environ["XDG_CACHE_HOME"]) / "blender_rl_guiding" / "references").rglob("*-3-bounces/*.exr"))
    assert 1 <= len(blocks) < 3
    written = {path: path.stat().st_mtime_ns for path in blocks}
    assert rlg(*command).returncode == 0
    assert {path: path.stat().st_mtime_ns for path in blocks} == written


def test_other_settings_are_rendered_anew(rlg, bundle, tmp_path):
    command = ["compare", bundle, "--methods", "bsdf", "--reference-spp", 1, "--out", tmp_path / "out"]
    assert rlg(*command, "--spp", 2).returncode == 0
    assert "done before" in rlg(*command, "--spp", 2).stderr
    assert "done before" not in rlg(*command, "--spp", 3).stderr
    assert table(tmp_path / "out")[0]["spp"] == "3"
    assert "done before" not in rlg(*command, "--spp", 99, "--noise", 1).stderr
    assert "done before" in rlg(*command, "--spp", 99, "--noise", 1).stderr  # with fewer samples than it might have had


def test_a_better_reference_judges_finished_runs_again(rlg, bundle, tmp_path):
    command = ["compare", bundle, "--methods", "bsdf", "--spp", 2, "--max-bounces", 2, "--out", tmp_path / "out"]
    assert rlg(*command, "--reference-spp", 128).returncode == 0
    (before,) = table(tmp_path / "out")
    assert "done before" in rlg(*command, "--reference-spp", 256).stderr
    (after,) = table(tmp_path / "out")
    assert after["relmse"] != before["relmse"]
    assert float(after["relmse"]) == pytest.approx(float(before["relmse"]), rel=0.2)


def test_an_interrupted_sweep_with_jobs_goes_on(rlg, interrupted, tmp_path):
    """And is the same as one without jobs."""
    save(replace(scenes.tiny(8), name="a1"), tmp_path / "a1.npz")
    sweep = ["sweep", "slides-resolution", "--scenes", tmp_path, "--seeds", 2, "--spp", 3, "--reference-spp", 128]
    assert rlg(*sweep, "--out", tmp_path / "whole").returncode == 0
    out = tmp_path / "cut"
    status, said = interrupted("experiments.forecast:Forecast:end", 3, *sweep, "--out", out, "--jobs", 2, after=0)
    assert status == 130, said
    before = finished(out)
    assert 3 <= len(before) < 10
    assert not list(out.rglob("report.html"))
    again = rlg(*sweep, "--out", out, "--jobs", 2)
    assert again.returncode == 0
    assert again.stdout.splitlines()[-1] == str(out / "slides-resolution" / "report.html")
    assert again.stderr.count("done before") == len(before)
    assert {run: finished(out)[run] for run in before} == before
    assert table(out / "slides-resolution") == table(tmp_path / "whole" / "slides-resolution")
