"""Run folders of unknown origin: each gives a report with a list of the left-out runs, or one error line."""

import io
import json
import os
import re
import shutil
import unicodedata
from collections.abc import Iterator
from pathlib import Path

import pytest
from rich.console import Console

from benchmarks.reliability import mutations
from blender_rl_guiding import images, report
from blender_rl_guiding.doors import cli
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.report import discs, figures, load, page_pictures
from blender_rl_guiding.report.handover import handed_over
from tests.unit.test_page_probe import add_probe
from tests.unit.test_report import make_experiment, write_figures

FILES = ("experiment.json", "c1/probe.json", "c1/dqn/seed-0/result.json")
WHOLE = os.environ.get("RLG_ALL_MUTATIONS") == "1"  # all mutations take minutes; by default a fixed part of them is tried


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tiny folder with everything a report can show."""
    folder = make_experiment(tmp_path_factory.mktemp("good"), size=4, methods={"uniform": 0.6, "dqn": 0.2})
    add_probe(folder, {"dqn": (3, 4)})
    return folder


@pytest.fixture(autouse=True)
def _small_and_few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figures, "write", lambda results: None)
    monkeypatch.setattr(page_pictures, "DISC", 6)
    monkeypatch.setattr(discs, "SMOOTH", 1)


def outcome(folder: Path, all_of_it: bool = False) -> str:
    """Make the report of a folder. Returns the first line about damage, or "". all_of_it: also make figures and tables, which is slow."""
    outside = listing(folder.parent)
    try:
        results = report.write(folder)
        if all_of_it:
            report.show(results, Console(file=io.StringIO()))
            write_figures(results)
        if results.scenes[0] in results.pictures:
            json.dumps(handed_over(results)).encode()
        line = "".join(results.damaged[:1])
        page = (folder / "report.html").read_text(encoding="utf-8")
        assert not results.damaged or "<b>Damaged:</b>" in page
    except InputError as error:
        line = str(error)
        assert line
    assert not any(unicodedata.category(letter) in ("Cc", "Cs") for letter in line), ascii(line)
    assert len(line) < 1000
    assert listing(folder.parent) == outside
    return line


def listing(folder: Path) -> list[str]:
    """The names in a folder. For the parent of a run folder they must stay: a name with `..` could write there."""
    return sorted(path.name for path in folder.iterdir())


def chosen(found: Iterator[tuple[str, object]], count: int, seed: int) -> list:
    return list(found) if WHOLE else mutations.some(found, count, seed)


@pytest.mark.parametrize("name", FILES)
def test_any_value_of_any_file(good: Path, tmp_path: Path, name: str):
    copy = shutil.copytree(good, tmp_path / "folder")
    fine = 0
    for k, (what, text) in enumerate(chosen(mutations.of_json((good / name).read_text()), 120, seed=1)):
        (copy / name).write_text(text)
        with mutations.named(what):
            fine += not outcome(copy, all_of_it=not k % 40)
    assert fine


def test_no_text_is_a_formula(good: Path, tmp_path: Path):
    """Makes figures, too, because matplotlib would read a text between $ signs as a formula."""
    copy = shutil.copytree(good, tmp_path / "folder")
    name, fine = "c1/dqn/seed-0/result.json", 0
    for what, text in mutations.of_json((good / name).read_text()):
        if what.startswith("settings.guide") and '"$x^$"' in what:
            (copy / name).write_text(text)
            with mutations.named(what):
                fine += not outcome(copy, all_of_it=True)
    assert fine > 1  # mutations of the guide's kind and of its error: the axes show both


@pytest.mark.parametrize("name", [*FILES, "c1/reference.exr", "c1/dqn/seed-0/image.exr"])
def test_any_bytes_of_any_file(good: Path, tmp_path: Path, name: str):
    copy = shutil.copytree(good, tmp_path / "folder")
    for what, data in mutations.of_bytes((good / name).read_bytes(), seed=2, count=100 if WHOLE else 5):
        (copy / name).write_bytes(data)
        with mutations.named(what):
            outcome(copy)


def test_any_file_that_is_none_or_another(good: Path, tmp_path: Path):
    for what, do in chosen(mutations.of_files(good), 50, seed=3):
        copy = shutil.copytree(good, tmp_path / "folder")
        do(copy)
        with mutations.named(what):
            outcome(copy)
        shutil.rmtree(copy)


def test_a_pipe_is_not_waited_for(good: Path, tmp_path: Path):
    copy = shutil.copytree(good, tmp_path / "folder")
    for name in ("c1/dqn/seed-1/result.json", "c1/uniform/seed-0/image.exr", "c1/probe.json"):
        (copy / name).unlink()
        os.mkfifo(copy / name)
    assert [line.split(":")[0].removeprefix("cannot read ") for line in load(copy).damaged] == [
        "c1/dqn/seed-1/result.json",
        "c1/probe.json",
        "c1/uniform/seed-0/image.exr",
    ]


def test_an_image_is_not_unpacked_where_memory_does_not_suffice(good: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    copy = shutil.copytree(good, tmp_path / "folder")
    monkeypatch.setattr(images, "available", lambda: 4 * 4 * 6 * 4 - 1)
    lines = load(copy).damaged
    assert len(lines) == 1
    assert lines[0].startswith("c1/reference.exr takes 384 bytes of memory, but only 383 bytes are free")


def test_no_image_is_decoded_twice(good: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    copy = shutil.copytree(good, tmp_path / "folder")
    decoded: list[int] = []
    monkeypatch.setattr(images, "available", lambda: decoded.append(1) or 2**40)  # called once for each image
    outcome(copy, all_of_it=True)
    assert len(decoded) == 1 + 2  # the reference and the first run of each method


def test_the_command_lists_what_is_damaged_and_fails(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    copy = shutil.copytree(good, tmp_path / "folder")
    for seed in "01":
        (copy / "c1" / "dqn" / f"seed-{seed}" / "result.json").write_text("{}")
    assert cli.main(["report", str(copy)]) == 2
    said = capsys.readouterr()
    assert said.out.endswith(f"{copy / 'report.html'}\n")
    assert re.fullmatch(r"rlg: \S+: c1/dqn/seed-0/result.json: not a result.*, and 1 more: left out, as the report says\n", said.err)


def test_what_failed_and_what_is_damaged_is_told_at_once(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    names = ("none", "damaged", "whole")
    none, damaged, whole = (shutil.copytree(good, tmp_path / name) for name in names)
    shutil.rmtree(none / "c1")
    (damaged / "c1" / "dqn" / "seed-0" / "result.json").write_text("{}")
    with pytest.raises(InputError) as error:
        cli._tell([none, damaged, whole], failed=4)
    parts = str(error.value).split("; ")
    assert parts[0] == "4 of the runs failed, as told above"
    assert parts[2] == f"{none}: no run of the experiment is finished"
    assert parts[3].startswith(f"{damaged}: c1/dqn/seed-0/result.json: not a result")
    assert len(parts) == 4
    said = capsys.readouterr().out
    assert [str(folder / "report.html") in said for folder in (none, damaged, whole)] == [False, True, True]
