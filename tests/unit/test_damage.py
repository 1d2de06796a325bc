"""Each kind of damage in a run folder: the report leaves out the run, and a line says why."""

import hashlib
import json
import math
import shutil
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.images import write_exr
from blender_rl_guiding.measures import NAMES
from blender_rl_guiding.report import figures, load, result_file, write
from tests.unit.test_report import change, make_experiment, page_of, write_figures


@pytest.fixture(autouse=True)
def _no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figures, "write", lambda results: None)


@pytest.fixture(scope="module")
def _made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_experiment(tmp_path_factory.mktemp("made"), seeds=2)


@pytest.fixture
def made(_made: Path, tmp_path: Path) -> Path:
    """A copy of the folder of `make_experiment`. Making the folder takes half a second, so it is made only once."""
    return shutil.copytree(_made, tmp_path / "made")


def plan(**values: Any) -> str:
    """An experiment.json."""
    return json.dumps({"methods": ["m0"], "scenes": ["s"], "seeds": [0], "baseline": "m0", "command": ""} | values)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("experiment.json", None, "cannot read"),
        ("experiment.json", "{", "not JSON"),
        ("experiment.json", "{}", "not an experiment"),
        ("experiment.json", '{"methods": ["a"], "scenes": [], "seeds": [0], "baseline": "b", "command": ""}', "baseline 'b'"),
        ("experiment.json", '{"methods": ["a"], "scenes": ["s"], "seeds": [0], "baseline": "a", "command": ""}', "no run"),
        (
            "experiment.json",
            '{"methods": ["a", "a"], "scenes": [], "seeds": [0], "baseline": "a", "command": ""}',
            "'a' stands in methods twice",
        ),
        ("experiment.json", plan(methods=[f"m{k}" for k in range(101)]), "101 methods"),
        ("experiment.json", plan(seeds=[*range(100_001)]), "100001 runs"),
        ("experiment.json", '{"methods": ["a"], "scenes": ["../x"], "seeds": [0], "baseline": "a", "command": ""}', "cannot be the name"),
    ],
)
def test_a_damaged_plan_is_told_in_one_line_and_writes_nothing(made: Path, name: str, content: str | None, message: str):
    (made / name).unlink()
    if content is not None:
        (made / name).write_text(content)
    with pytest.raises(InputError, match=message) as error:
        write(made)
    assert "\n" not in str(error.value)
    assert str(made) in str(error.value)
    assert not (made / "report.html").exists()
    assert not (made / "table.csv").exists()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("c1/reference.exr", None, "cannot read"),
        ("c1/reference.exr", b"damaged", "not an EXR"),
        ("c1/reference.exr", np.ones((5, 7, 3)), "7 x 5 pixels, not 24 x 24"),
        ("c1/bsdf/seed-0/image.exr", None, "cannot read"),
        ("c1/bsdf/seed-0/image.exr", np.ones((5, 7, 3)), "7 x 5 pixels, not 24 x 24"),
        ("c1/bsdf/seed-0/image.exr", np.full((24, 24, 3), np.nan), "not finite"),
        ("c1/bsdf/seed-0/result.json", b'{"seed": 0', "not JSON"),
        ("c1/bsdf/seed-0/result.json", b"[]", "not a result"),
        ("c1/bsdf/seed-0/result.json", b'{"seed": 0}', "not a result"),
        ("c1/probe.json", b"{}", "not a probe"),
    ],
)
def test_what_is_damaged_is_listed_and_left_out(made: Path, name: str, content: bytes | np.ndarray | None, message: str):
    path = made / name
    path.unlink(missing_ok=True)
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif content is not None:
        write_exr(path, content, {})
    page, found = page_of(made), load(made)
    (line,) = found.damaged
    assert message in line
    assert name in line
    assert str(made) not in line  # other people may see the page
    assert f"<li>{escape(line)}</li>" in page
    assert len(found.runs) == 6 - ("seed-0" in name)
    assert ("<h3>Images</h3>" in page) == ("reference" not in name)


def test_an_image_of_another_run_is_not_shown(made: Path):
    first, second = (made / "c1" / "bsdf" / f"seed-{seed}" for seed in (0, 1))
    for place in (first, second):
        digest = hashlib.sha256((place / "image.exr").read_bytes()).hexdigest()
        path = place / "result.json"
        result_file.write(path, replace(result_file.read(path), images={"image.exr": digest}))
    assert not load(made).damaged
    shutil.copy(second / "image.exr", first / "image.exr")
    found = load(made)
    assert found.damaged == ("c1/bsdf/seed-0/image.exr is not the image that was written with its result.json",)
    assert [run.seed for run in found.runs if run.method == "bsdf"] == [1]


@pytest.mark.parametrize(
    "bad",
    [
        {"seconds": 0},
        {"seconds": math.inf},
        {"rays": 1.5},
        {"metrics": None},
        {"metrics": {"flip": 0.1}},
        {"metrics": dict.fromkeys(NAMES, math.nan)},
        {"losses": ["x"]},
        {"curve": [{"samples": 1, "seconds": math.nan}]},
        {"curve": [{"seconds": 1.0, "mape": 1.0}]},
        {"settings": {"guide": {"kind": "dqn", "error": "../x"}}},
        {"machine": {"a": "\ud800"}},
        {"probe": {"pixel": [0, 0], "rows": 2, "columns": 2, "q": [1, 2, 3]}},
    ],
)
def test_a_result_with_numbers_that_cannot_be_is_damaged(made: Path, bad: dict[str, Any]):
    path = made / "c1" / "dqn" / "seed-0" / "result.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | bad))
    assert load(made).damaged[0].startswith("c1/dqn/seed-0/result.json: not a result")


@pytest.mark.parametrize("other", [{"scene": "a1"}, {"method": "bsdf"}, {"seed": 1}, {"resolution": [12, 48]}])
@pytest.mark.parametrize("seed", [0, 1])  # the seed whose pictures are shown, and another seed
def test_the_result_of_another_run_is_not_this_ones(made: Path, other: dict[str, Any], seed: int):
    path = made / "c1" / "dqn" / f"seed-{seed}" / "result.json"
    values = {"seed": seed} | {name: value + seed if name == "seed" else value for name, value in other.items()}
    change(path, **values)
    page, found = page_of(made), load(made)
    (line,) = found.damaged
    assert line.startswith(f"c1/dqn/seed-{seed}/result.json is of another run: ")
    assert escape(line) in page
    assert [run.seed for run in found.runs if run.method == "dqn"] == [1 - seed]
    assert len(found.runs) == 5


@pytest.mark.parametrize("folder", ["c1", "c1/c1/c1", "c", "dqn"])
def test_a_line_names_the_place_within_the_folder(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: str):
    """Lines name files by their path within the folder. The folder may contain a folder of its own name; its path may be relative."""
    (made / "c1" / "dqn" / "seed-0" / "result.json").write_text("[]")
    (made / "c1" / "bsdf" / "seed-0" / "image.exr").unlink()
    (tmp_path / folder).parent.mkdir(parents=True, exist_ok=True)
    made.rename(tmp_path / folder)
    monkeypatch.chdir(tmp_path)
    lines = {load(place).damaged for place in (Path(folder), tmp_path / folder)}
    monkeypatch.chdir(tmp_path / folder)
    (said,) = lines | {load(Path()).damaged}
    assert [line.split(":")[0] for line in said] == ["c1/dqn/seed-0/result.json", "cannot read c1/bsdf/seed-0/image.exr"]


def test_nothing_is_read_or_written_through_a_link_that_leads_out(tmp_path: Path):
    """The target of the link may be a private file of the person who makes the report, and then shows it to others."""
    others, folder = tmp_path / "others", make_experiment(tmp_path / "folder", seeds=1)
    make_experiment(others, seeds=1)
    for name in ("uniform/seed-0/image.exr", "bsdf/seed-0/result.json", "dqn"):
        _remove(folder / "c1" / name)
        (folder / "c1" / name).symlink_to(others / "c1" / name)
    with pytest.raises(InputError, match=r"c1/bsdf/seed-0/result\.json leads out of"):
        load(folder)
    (folder / "c1" / "dqn").unlink()
    (folder / "c1" / "dqn").symlink_to("own")
    shutil.copytree(others / "c1" / "dqn", folder / "c1" / "own")
    found = load(folder)
    assert [run.method for run in found.runs] == ["dqn"]
    assert sum("leads out" in line for line in found.damaged) == 2
    (folder / "figures").symlink_to(others)
    with pytest.raises(InputError, match="figures leads out of"):
        write_figures(found)
    (tmp_path / "kept").write_text("kept")
    (folder / "report.html").symlink_to(tmp_path / "kept")  # writing the report replaces the link itself
    write(folder)
    assert (tmp_path / "kept").read_text() == "kept"


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink()
