"""After an interrupt, a comparison keeps its finished runs, renders the other runs, and ends with the same numbers."""

import csv
import hashlib
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blender_rl_guiding.experiments import runner
from blender_rl_guiding.images import write_exr
from blender_rl_guiding.locks import writing
from blender_rl_guiding.report import figures, result_file
from blender_rl_guiding.report.results import COLUMNS
from blender_rl_guiding.scene.bundle import save
from tests import scenes
from tests.system.conftest import ROOT
from tests.system.small import SMALL

TIMES = {"seconds", "learn_seconds", "train_seconds", "infer_seconds"}
COMPARE = ["--methods", "uniform,dqn", "--spp", "8", "--seeds", "2", "--reference-spp", "256", *SMALL]


def table(out: Path) -> list[dict[str, str]]:
    """The rows of table.csv without times."""
    with (out / "table.csv").open() as file:
        return [{name: value for name, value in row.items() if name not in TIMES} for row in csv.DictReader(file)]


def finished(out: Path) -> dict[str, int]:
    """Finished run -> time when it was written."""
    return {str(path.parent.relative_to(out)): os.stat(path).st_mtime_ns for path in out.rglob("result.json")}


def references() -> list[Path]:
    """The cached blocks of all scenes."""
    return list((Path(os.environ["XDG_CACHE_HOME"]) / "blender_rl_guiding" / "references").rglob("block-*.exr"))


def test_an_interrupted_comparison_goes_on(rlg, interrupted, bundle, tmp_path):
    assert rlg("compare", bundle, *COMPARE, "--out", tmp_path / "whole").returncode == 0
    out = tmp_path / "cut"
    status, said = interrupted("experiments.produce::save_run", 3, "compare", bundle, *COMPARE, "--out", out, after=0)
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
    assert "done before" in rlg(*command, "--spp", 99, "--noise", 1).stderr  # finished with fewer samples than its limit


def test_a_better_reference_judges_finished_runs_again(rlg, bundle, tmp_path):
    command = ["compare", bundle, "--methods", "bsdf", "--spp", 2, "--max-bounces", 2, "--out", tmp_path / "out"]
    assert rlg(*command, "--reference-spp", 128).returncode == 0
    (before,) = table(tmp_path / "out")
    assert "done before" in rlg(*command, "--reference-spp", 256).stderr
    (after,) = table(tmp_path / "out")
    assert after["relmse"] != before["relmse"]
    assert float(after["relmse"]) == pytest.approx(float(before["relmse"]), rel=0.2)


DAMAGE: dict[str, Callable[[Path], object]] = {
    "seed-0": lambda run: (run / "result.json").write_text("[]"),
    "seed-1": lambda run: (run / "result.json").write_text('{"versions": null}'),
    "seed-2": lambda run: (run / "image.exr").unlink(),
    "seed-3": lambda run: write_exr(run / "image.exr", np.ones((3, 3, 3), np.float32), {}),
    "seed-4": lambda run: shutil.copy(run.parent / "seed-7" / "image.exr", run / "image.exr"),
    "seed-5": lambda run: give(run, np.ones((7, 9, 3), np.float32)),
    "seed-6": lambda run: (run / "image.exr").unlink() or os.mkfifo(run / "image.exr"),
}


def give(run: Path, image: np.ndarray) -> None:
    """Put another image into a run, with a matching record."""
    write_exr(run / "image.exr", image, {})
    digest = hashlib.sha256((run / "image.exr").read_bytes()).hexdigest()
    record = result_file.read(run / "result.json")
    result_file.write(run / "result.json", replace(record, images=record.images | {"image.exr": digest}))


def test_what_is_damaged_is_done_again_and_told(rlg, bundle, tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "write", lambda results: None)  # figures would take longer than the rest of the test
    out = tmp_path / "out"
    command = ["compare", bundle, "--methods", "qtable", "--seeds", 8, "--spp", 2, "--reference-spp", 128, "--out", out]
    assert rlg(*command).returncode == 0
    right = table(out)
    for seed, damage in DAMAGE.items():
        damage(out / "tiny" / "qtable" / seed)
    for block in references():
        block.write_bytes(block.read_bytes()[:-9])
    (out / "tiny" / "probe.json").write_text("null")
    (out / "tiny" / "reference.exr").write_bytes(b"")
    again = rlg(*command)
    assert again.returncode == 0
    told = [line for line in again.stderr.splitlines() if "again" in line]
    assert len(told) == len(DAMAGE) + 2, again.stderr
    assert again.stderr.count("done before") == 1
    assert table(out) == right
    assert "again" not in rlg(*command).stderr


@pytest.mark.parametrize("image", [np.ones((7, 9, 3), np.float32), np.full((12, 12, 3), np.nan, np.float32)], ids=["size", "nan"])
def test_a_run_whose_image_cannot_be_judged_is_done_again_once(image, rlg, bundle, tmp_path, monkeypatch):
    """The record of the run is correct. Also: the clock of a run starts only after all kernels are compiled."""
    monkeypatch.setattr(figures, "write", lambda results: None)
    prepared: list[int] = []
    prepare = runner._prepare
    monkeypatch.setattr(runner, "_prepare", lambda *args: prepared.append(1) or prepare(*args))
    command = ["compare", bundle, "--methods", "bsdf", "--spp", 2, "--reference-spp", 128, "--out", tmp_path / "out"]
    assert rlg(*command).returncode == 0
    right = table(tmp_path / "out")
    give(tmp_path / "out" / "tiny" / "bsdf" / "seed-0", image)
    again = rlg(*command)
    assert again.returncode == 0
    assert "the run is made again" in again.stderr
    assert "done before" not in again.stderr
    assert len(prepared) == 2
    assert table(tmp_path / "out") == right
    assert "done before" in rlg(*command).stderr


ENDLESS = ("experiment.json", "tiny/reference.exr", "tiny/probe.json")


@pytest.mark.parametrize("name", ENDLESS)
def test_no_file_of_a_comparison_leads_out_of_its_folder(name, rlg, bundle, tmp_path):
    path, command = tmp_path / "out" / name, ["compare", bundle, "--methods", "qtable", "--out", tmp_path / "out"]
    path.parent.mkdir(parents=True)
    path.symlink_to("/dev/zero")
    refused = rlg(*command)
    assert refused.returncode == 2
    assert refused.stderr == f"rlg: {path} leads out of {tmp_path / 'out'}, by a link\n"


WRITERS: dict[str, list[object]] = {
    "render": ["render", "{bundle}"],
    "animate": ["render", ROOT / "scenes" / "c1.blend", "--frames", "1..2"],
    "inspect": ["inspect", "{bundle}", "--guide", "qtable"],
    "compare": ["compare", "{bundle}", "--methods", "bsdf"],
    "sweep": ["sweep", "slides-resolution"],
}


@pytest.mark.parametrize("writer", WRITERS)
def test_two_never_write_to_one_folder(writer, rlg, bundle, tmp_path):
    out = tmp_path / "out"
    held = out / "slides-resolution" if writer == "sweep" else out
    with writing(held):
        refused = rlg(*(str(part).format(bundle=bundle) for part in WRITERS[writer]), "--out", out)
    assert refused.returncode == 2
    (line,) = refused.stderr.splitlines()
    assert line.startswith(f"rlg: {held} is being written to by process {os.getpid()} on ")
    assert not out.exists()


def test_an_interrupted_sweep_with_jobs_goes_on(rlg, interrupted, tmp_path):
    """Its results equal those of a sweep without jobs."""
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
