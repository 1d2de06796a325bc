"""A reference from a file is used only for its own scene. Errors against different references are never mixed."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blender_rl_guiding import report
from blender_rl_guiding.comparison import Comparison
from blender_rl_guiding.doors.worker import Events
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.experiments.progress import Progress
from blender_rl_guiding.experiments.references import Given
from blender_rl_guiding.experiments.runner import Experiment, run
from blender_rl_guiding.images import read_exr, write_exr
from blender_rl_guiding.images.metrics import mape
from blender_rl_guiding.report.page import page
from blender_rl_guiding.settings import BSDF, Machine, QTable, Render, Uniform
from tests import scenes

METHODS = ("uniform", Render(spp=2, guide=Uniform())), ("bsdf", Render(spp=2, guide=BSDF()))


@pytest.fixture
def silent() -> Progress:
    class Nowhere:
        def write(self, text: str) -> None: ...
        def flush(self) -> None: ...

    return Events(Nowhere()).bar


def given(folder: Path, brightness: float, size: int = 12) -> Path:
    path = folder / f"grey {brightness}.exr"
    write_exr(path, np.full((size, size, 3), brightness, np.float32), {})
    return path


def experiment(folder: Path, given: Path, count: int = 1) -> Experiment:
    tiny = tuple(replace(scenes.tiny(12), name=f"tiny{k}") for k in range(count))
    asked = Comparison(METHODS, budget="EACH", reference="FILE", reference_file=given)
    return Experiment(folder / "out", tiny, asked, "test")


def results(folder: Path) -> dict[str, dict]:
    return {path.parent.parent.name: json.loads(path.read_text(encoding="utf-8")) for path in folder.rglob("result.json")}


def test_another_reference_judges_anew_without_rendering(compiled: None, silent: Progress, tmp_path: Path):
    assert run([experiment(tmp_path, given(tmp_path, 0.5))], Machine(), 1, silent) == 0
    before = results(tmp_path)
    images = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("image.exr")}
    assert all("mape_display" in entry for values in before.values() for entry in values["curve"])
    assert run([experiment(tmp_path, given(tmp_path, 0.25))], Machine(), 1, silent) == 0
    after = results(tmp_path)
    assert {path: path.stat().st_mtime_ns for path in images} == images
    for method, values in after.items():
        image, _ = read_exr(tmp_path / "out" / "tiny0" / method / "seed-0" / "image.exr")
        assert values["metrics"]["mape"] == mape(image, np.full((12, 12, 3), 0.25, np.float32))
        assert values["judged_by"] != before[method]["judged_by"]
        assert not any("mape_display" in entry or "relmse" in entry for entry in values["curve"])
    assert "(grey 0.25.exr)" in page(report.write(tmp_path / "out"))


def test_the_same_reference_changes_nothing(compiled: None, silent: Progress, tmp_path: Path):
    for _ in range(2):
        assert run([experiment(tmp_path, given(tmp_path, 0.5))], Machine(), 1, silent) == 0
    assert all("mape_display" in entry for values in results(tmp_path).values() for entry in values["curve"])


@pytest.mark.parametrize(("size", "count", "message"), [(13, 1, "13 x 13 pixels, but scene 'tiny0' renders 12 x 12"), (12, 2, "2 scenes")])
def test_what_is_no_reference_is_refused(compiled: None, silent: Progress, tmp_path: Path, size: int, count: int, message: str):
    with pytest.raises(InputError, match=message):
        run([experiment(tmp_path, given(tmp_path, 0.5, size), count)], Machine(), 1, silent)


def test_a_reference_by_cycles_has_to_be_there(compiled: None, silent: Progress, tmp_path: Path):
    by_cycles = replace(experiment(tmp_path, given(tmp_path, 0.5)), comparison=Comparison(METHODS, budget="EACH", reference="CYCLES"))
    with pytest.raises(InputError, match="a reference by Cycles is made in Blender alone"):
        run([by_cycles], Machine(), 1, silent)
    assert not (tmp_path / "out").exists()
    assert run([replace(by_cycles, cycles=Given(given(tmp_path, 0.5), "Cycles 5.2"))], Machine(), 1, silent) == 0
    assert json.loads((tmp_path / "out" / "experiment.json").read_text(encoding="utf-8"))["reference"] == "Cycles 5.2"


@pytest.mark.parametrize("name", ["a/b", "..", "", "what?", " a"])
def test_a_scene_whose_name_no_folder_can_have_is_refused(name: str, silent: Progress, tmp_path: Path):
    fine = experiment(tmp_path, given(tmp_path, 0.5))
    with pytest.raises(InputError, match="cannot be the name of a file or folder"):
        run([replace(fine, scenes=(replace(fine.scenes[0], name=name),))], Machine(), 1, silent)


@pytest.mark.parametrize("link", ["tiny0", "tiny0/bsdf", "tiny0/bsdf/seed-0"])
def test_nothing_is_written_through_a_link_that_leads_out(link: str, silent: Progress, tmp_path: Path):
    """A user may continue a comparison in a folder that somebody else made."""
    (tmp_path / "elsewhere").mkdir()
    place = tmp_path / "out" / link
    place.parent.mkdir(parents=True)
    place.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="leads out of"):
        run([experiment(tmp_path, given(tmp_path, 0.5))], Machine(), 1, silent)
    assert not [*(tmp_path / "elsewhere").iterdir()]


def test_a_file_says_what_was_compared(compiled: None, silent: Progress, tmp_path: Path):
    """Checks the keys of experiment.json, because reports of all versions read this file."""
    assert run([replace(experiment(tmp_path, given(tmp_path, 0.5)), name="slides-a")], Machine(), 1, silent) == 0
    assert json.loads((tmp_path / "out" / "experiment.json").read_text(encoding="utf-8")) == {
        "name": "slides-a",
        "scenes": ["tiny0"],
        "methods": ["uniform", "bsdf"],
        "seeds": [0],
        "baseline": "uniform",
        "command": "test",
        "reference": "grey 0.5.exr",
    }


def test_what_is_learnt_is_shown_if_it_is_asked_for(compiled: None, silent: Progress, tmp_path: Path):
    plain = experiment(tmp_path, given(tmp_path, 0.5))
    learner = replace(plain.comparison, methods=(("table", Render(spp=2, guide=QTable(cells=4, recorded=500))),))
    for asked in (False, True):
        out = tmp_path / f"asked-{asked}"
        assert run([replace(plain, folder=out, comparison=replace(learner, use_probe=asked))], Machine(), 1, silent) == 0
        assert (out / "tiny0" / "probe.json").exists() == asked


def test_more_runs_than_a_report_can_show_are_refused(silent: Progress, tmp_path: Path):
    fine = experiment(tmp_path, given(tmp_path, 0.5))
    with pytest.raises(InputError, match="an experiment of 200000 runs; 100000 are the most"):
        run([replace(fine, comparison=replace(fine.comparison, seeds=100_000))], Machine(), 1, silent)
    assert not (tmp_path / "out").exists()
