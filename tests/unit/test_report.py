"""The report: numbers against those worked out by hand, whatever may be missing or damaged, and nothing unescaped."""

import csv
import hashlib
import json
import math
import re
import shutil
import zlib
from base64 import b64decode, b64encode
from html import escape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from scipy.stats import t

from blender_rl_guiding.errors import InputError
from blender_rl_guiding.experiments import charts, figures, pictures, results
from blender_rl_guiding.experiments.folders import load
from blender_rl_guiding.experiments.report import show, text_table, write
from blender_rl_guiding.images import write_exr
from blender_rl_guiding.metrics import compare

write_figures = figures.write  # before it is replaced, below
METHODS = {"uniform": 0.6, "bsdf": 0.3, "dqn": 0.15}
GUIDE = {"kind": "dqn", "error": "squared", "width": 64, "encoder": {"kind": "frequency", "octaves": 8}}


@pytest.fixture(autouse=True)
def _no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """They take longer than all the rest, and have a test of their own."""
    monkeypatch.setattr(figures, "write", lambda results: None)


def reference(size: int = 24) -> np.ndarray:
    y, x = np.mgrid[0:size, 0:size] / size
    return np.stack([0.2 + x, 0.8 * (x - 0.5) ** 2 + 0.1, 1.2 - y], axis=-1).astype(np.float32)


def make_run(folder: Path, method: str, seed: int, noise: float, truth: np.ndarray) -> None:
    rng = np.random.default_rng((seed, int(noise * 1000)))
    image = (truth * rng.gamma(1 / noise**2, noise**2, size=truth.shape)).astype(np.float32)
    place = folder / method / f"seed-{seed}"
    write_exr(place / "image.exr", image, {})
    learns = method == "dqn"
    errors = [{"samples": 2**k, "seconds": (0.1 + 0.01 * seed) * 2**k, "mape_display": noise / 2**k, "relmse": 0.5**k} for k in range(6)]
    parts = {"train_seconds": 0.1, "infer_seconds": 0.05} if learns else {}
    result: dict[str, Any] = {
        "scene": folder.name, "scene_key": "ab" * 32, "method": method, "seed": seed, "spp": 32, "resolution": [*truth.shape[1::-1]],
        "seconds": 2.0 + learns + 0.1 * seed, "learn_seconds": 1.0 * learns, "rays": 4_000_000, "metrics": compare(image, truth),
        "settings": {"samples": 32, "nee": False, "seed": seed, "guide": GUIDE if learns else {"kind": method}},
        "machine": {"cpu": "Some <CPU>", "threads": 2}, "versions": {"blender_rl_guiding": "0.1.0"},
    }  # fmt: skip
    losses = [2.0 / k + 0.1 * rng.random() for k in range(1, 251)] if learns else []
    (place / "result.json").write_text(json.dumps(result | {"curve": [entry | parts for entry in errors], "losses": losses}))


def make_experiment(
    folder: Path, scenes: tuple[str, ...] = ("c1",), seeds: int = 2, size: int = 24, methods: dict[str, float] = METHODS
) -> Path:
    """An experiment's folder with images that are the reference times gamma noise; `methods` are its standard deviations."""
    for scene in scenes:
        write_exr(folder / scene / "reference.exr", reference(size), {})
        for method, noise in methods.items():
            for seed in range(seeds):
                make_run(folder / scene, method, seed, noise, reference(size))
    plan = {
        "methods": [*methods],
        "scenes": [*scenes],
        "seeds": [*range(seeds)],
        "baseline": "uniform",
        "command": "rlg compare c1.blend --methods 'a<b>'",
    }
    (folder / "experiment.json").write_text(json.dumps(plan))
    return folder


@pytest.fixture(scope="module")
def _made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_experiment(tmp_path_factory.mktemp("made"), seeds=2)


@pytest.fixture
def made(_made: Path, tmp_path: Path) -> Path:
    """A folder as `make_experiment` makes it, which takes half a second."""
    return shutil.copytree(_made, tmp_path / "made")


def page_of(folder: Path) -> str:
    write(folder)
    return (folder / "report.html").read_text(encoding="utf-8")


def test_the_table_has_a_row_for_each_run(tmp_path: Path):
    write(make_experiment(tmp_path, ("c1", "a1"), seeds=2))
    with (tmp_path / "table.csv").open() as file:
        rows = list(csv.DictReader(file))
    names = "scene,method,seed,spp,seconds,learn_seconds,train_seconds,infer_seconds,rays,mape_display,mape,relmse,flip"
    assert ",".join(rows[0]) == names
    assert [(r["scene"], r["method"], r["seed"]) for r in rows] == [(s, m, n) for s in ("c1", "a1") for m in METHODS for n in "01"]
    stored = json.loads((tmp_path / "a1" / "dqn" / "seed-1" / "result.json").read_text())
    assert float(rows[-1]["relmse"]) == stored["metrics"]["relmse"]
    assert float(rows[-1]["train_seconds"]) == pytest.approx(0.6)
    assert float(rows[-1]["infer_seconds"]) == pytest.approx(0.3)


def test_the_page_is_self_contained_escaped_and_has_the_numbers(tmp_path: Path):
    page = page_of(make_experiment(tmp_path))
    assert set(re.findall(r'(?:src|href)="(.{5})', page)) == {"data:"}
    assert "http:" not in page
    assert "https:" not in page
    assert "&#x27;a&lt;b&gt;&#x27;" in page
    assert "Some &lt;CPU&gt;" in page
    assert "Some <CPU>" not in page
    assert "{{" not in page
    summary = load(tmp_path).summaries("c1")[2]
    assert f"{summary.errors['relmse'].mean:.4g}" in page
    assert page.count("<img ") == 4 + 3
    assert "Beside the slides" not in page
    assert "guide.encoder.octaves" in page
    assert page.count("<polyline ") == 3 + 3 + 1  # errors over samples and over time, and the loss
    assert "20% +&ensp;10%" in page  # of 3.05 s
    assert "All scenes" not in page


def test_names_from_the_folder_cannot_break_the_page(tmp_path: Path):
    make_experiment(tmp_path)
    evil = "&lt;{{body}}'"
    for old in ("c1/dqn", "c1"):
        (tmp_path / old).rename((tmp_path / old).with_name(evil))
    plan = json.loads((tmp_path / "experiment.json").read_text()) | {"methods": ["uniform", "bsdf", evil], "scenes": [evil]}
    (tmp_path / "experiment.json").write_text(json.dumps(plan))
    page = page_of(tmp_path)
    assert "<title>uniform, bsdf, &amp;lt;{{body}}&#x27; on &amp;lt;{{body}}&#x27;</title>" in page


class _Parsed(HTMLParser):
    """Tags with their attributes, and the text behind each."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self.texts.append("")

    def handle_endtag(self, tag: str) -> None:
        self.tags.append((f"/{tag}", {}))
        self.texts.append("")

    def handle_data(self, data: str) -> None:
        if self.tags:
            self.texts[-1] += data


def test_a_browser_is_told_to_obey_nothing_but_the_pages_own_script_and_style(tmp_path: Path):
    parsed = _Parsed(page_of(make_experiment(tmp_path)))
    ((place, policy),) = [(k, a["content"]) for k, (_, a) in enumerate(parsed.tags) if a.get("http-equiv") == "Content-Security-Policy"]
    assert place <= 2  # before all that it is about: behind the language and the encoding
    rules = dict(rule.split(" ", 1) for rule in (policy or "").split("; "))
    for tag, rule in (("script", "script-src"), ("style", "style-src-elem")):
        # A browser runs no script of type text/plain, and so does not ask whether it may.
        (text,) = [text for (name, a), text in zip(parsed.tags, parsed.texts, strict=True) if name == tag and a.get("type") != "text/plain"]
        assert rules[rule] == f"'sha256-{b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
    assert rules["default-src"] == "'none'"
    assert rules["img-src"] == "data:"
    assert not [name for _, attributes in parsed.tags for name in attributes if name.startswith("on") or name == "href"]
    assert {source[:5] for _, attributes in parsed.tags if (source := attributes.get("src"))} == {"data:"}


def test_a_name_is_no_formula_and_no_markup(tmp_path: Path):
    methods = {"uniform": 0.6, "=1+1": 0.3, "@x": 0.2, "[red]x": 0.1, "_x": 0.1, "$x_1^2$": 0.2}
    found = load(make_experiment(tmp_path, methods=methods, seeds=1))
    rows = list(csv.DictReader(results.table(found).splitlines()))
    assert [row["method"] for row in rows] == ["uniform", "'=1+1", "'@x", "[red]x", "_x", "$x_1^2$"]
    console = Console(width=200)
    with console.capture() as capture:
        show(found, console)
    assert all(name in capture.get() for name in methods)
    write_figures(found)


def test_several_scenes_have_a_summary(tmp_path: Path):
    assert "All scenes" in page_of(make_experiment(tmp_path, ("c1", "a1"), seeds=1))


def test_the_terminal_shows_the_same(tmp_path: Path):
    make_experiment(tmp_path)
    console = Console(width=80)
    with console.capture() as capture:
        console.print(text_table(load(tmp_path)))
    text = capture.get()
    for summary in load(tmp_path).summaries("c1"):
        assert f"{summary.errors['flip'].mean:.4g}" in text
    assert "…" not in text


def test_no_number_is_cut_on_a_narrow_terminal(tmp_path: Path):
    make_experiment(tmp_path, methods={"uniform": 0.6, "a_method_with_a_long_name": 0.2})
    console = Console(width=40)
    with console.capture() as capture:
        show(load(tmp_path), console)
    assert "…" not in capture.get()
    assert "a_method_with_a_long_name" in capture.get()


def test_unfinished_runs_are_listed_and_left_out(tmp_path: Path):
    make_experiment(tmp_path, ("c1", "a1"))
    (tmp_path / "c1" / "dqn" / "seed-1" / "result.json").unlink()
    for file in (tmp_path / "a1").rglob("*.*"):
        file.unlink()
    page = page_of(tmp_path)
    found = load(tmp_path)
    assert found.missing[0] == "c1/dqn/seed-1"
    assert len(found.missing) == 1 + 6
    assert all(f"<li>{name}</li>" in page for name in found.missing)
    assert len(found.summaries("c1")[2].runs) == 1


def test_runs_of_an_earlier_larger_experiment_do_not_count(tmp_path: Path):
    make_experiment(tmp_path, seeds=3)
    plan = json.loads((tmp_path / "experiment.json").read_text())
    (tmp_path / "experiment.json").write_text(json.dumps(plan | {"seeds": [0, 2], "methods": ["dqn", "uniform"]}))
    found = load(tmp_path)
    assert [(run.method, run.seed) for run in found.runs] == [("dqn", 0), ("dqn", 2), ("uniform", 0), ("uniform", 2)]
    assert not found.missing


def test_a_missing_baseline_leaves_no_ratios(tmp_path: Path):
    make_experiment(tmp_path)
    for seed in "01":
        (tmp_path / "c1" / "uniform" / f"seed-{seed}" / "result.json").unlink()
    assert "×" not in re.sub("<p.*?</p>", "", page_of(tmp_path))


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
    assert str(made) not in line  # the page is shown to others
    assert f"<li>{escape(line)}</li>" in page
    assert len(found.runs) == 6 - ("seed-0" in name)
    assert ("<h3>Images</h3>" in page) == ("reference" not in name)


def test_an_image_of_another_run_is_not_shown(made: Path):
    first, second = (made / "c1" / "bsdf" / f"seed-{seed}" for seed in (0, 1))
    for place in (first, second):
        digest = hashlib.sha256((place / "image.exr").read_bytes()).hexdigest()
        values = json.loads((place / "result.json").read_text()) | {"images": {"image.exr": digest}}
        (place / "result.json").write_text(json.dumps(values))
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
        {"metrics": dict.fromkeys(results.MEASURES, math.nan)},
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


def test_nothing_is_read_or_written_through_a_link_that_leads_out(tmp_path: Path):
    """Its target may be any file of whoever makes the report, who then shows it to others."""
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
    (folder / "report.html").symlink_to(tmp_path / "kept")  # is itself replaced
    write(folder)
    assert (tmp_path / "kept").read_text() == "kept"


def _remove(path: Path) -> None:
    shutil.rmtree(path) if path.is_dir() else path.unlink()


def test_intervals_are_those_of_student():
    assert results.estimate([3.0]) == (3.0, None)
    mean, margin = results.estimate([1.0, 2.0, 4.0])
    assert mean == pytest.approx(7 / 3)
    assert margin == pytest.approx(t.ppf(0.975, 2) * np.std([1, 2, 4], ddof=1) / np.sqrt(3), rel=1e-4)
    for freedom in (1, 4, 9, 10, 15, 40, 1000):
        assert results._student(freedom) == pytest.approx(t.ppf(0.975, freedom), rel=2e-4)


def test_ratios():
    assert results.ratio(0.0, 0.0) == 1.0
    assert results.ratio(1.0, 0.0) == np.inf
    assert results.geometric_mean([2.0, 0.5]) == pytest.approx(1.0)
    assert results.geometric_mean([0.0, 2.0]) == 0.0


def test_the_viewers_pixels_are_within_one_part_in_256():
    rng = np.random.default_rng(5)
    image = np.exp(rng.uniform(-9, 9, size=(9, 11, 3))).astype(np.float32)
    image[0, 0] = 0.0
    planes = np.frombuffer(zlib.decompress(b64decode(pictures.rgbe(image))), np.uint8).reshape(4, 9, 11)
    decoded = planes[:3] * 2.0 ** (planes[3].astype(float) - 136)
    assert np.all(abs(decoded.transpose(1, 2, 0) - image) <= image.max(axis=-1, keepdims=True) / 250)


def test_the_scale_of_errors_is_round_and_common():
    assert pictures.scale([np.full((4, 4), 0.11), np.full((4, 4), 0.31)]) == 0.5
    assert pictures.scale([np.full((4, 4), 1.0)]) == 1.0
    assert pictures.scale([np.zeros((4, 4))]) == 1.0


def test_a_chart_without_points_is_empty():
    line = charts.Line("a", "red", [(0, 0.0), (1, float("nan"))])
    assert charts.chart([line], "x", "y", log_y=True) == ""
    assert "<polyline" in charts.chart([line], "x", "y")  # 0 has a place on a linear axis
    assert charts.chart([line], "x", "y", log_x=True) == ""
    assert "<polyline" in charts.chart([charts.Line("a", "red", [(1, 2.0)])], "x", "y", log_y=True)


def test_points_stand_where_the_ticks_say():
    linear, log = charts.axis([0.31, 0.52], log=False), charts.axis([0.02, 3.0], log=True)
    assert linear.ticks() == pytest.approx([0.3, 0.35, 0.4, 0.45, 0.5])
    assert log.ticks() == pytest.approx([0.02, 0.05, 0.1, 0.2, 0.5, 1, 2])
    assert log.along(0.2) - log.along(0.02) == pytest.approx(log.along(1) - log.along(0.1))
    assert linear.along(0.5) - linear.along(0.4) == pytest.approx(0.1 / (0.21 * 1.1))
    assert charts.axis([0.0], log=False).ticks()
