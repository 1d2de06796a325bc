"""The report: numbers equal those by hand, any part of the data may be missing, and all text is escaped."""

import csv
import hashlib
import json
import re
import zlib
from base64 import b64decode, b64encode
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from scipy.stats import t

from blender_rl_guiding.images import write_exr
from blender_rl_guiding.images.metrics import compare
from blender_rl_guiding.measures import NAMES
from blender_rl_guiding.report import figures, load, pictures, results, show, write
from blender_rl_guiding.report.numbers import runs
from blender_rl_guiding.report.texts import comma_separated

write_figures = figures.write  # the original, before the fixture below replaces it
METHODS = {"uniform": 0.6, "bsdf": 0.3, "dqn": 0.15}
GUIDE = {"kind": "dqn", "error": "squared", "width": 64, "encoder": {"kind": "frequency", "octaves": 8}}


@pytest.fixture(autouse=True)
def _no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes no figures: they take longer than the rest of the report, and have their own test."""
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
    """An experiment's folder. Its images are the reference times gamma noise. methods: standard deviation of the noise, by name."""
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


def change(path: Path, **values: Any) -> None:
    """Change values of a result.json."""
    path.write_text(json.dumps(json.loads(path.read_text()) | values))


def page_of(folder: Path) -> str:
    write(folder)
    return (folder / "report.html").read_text(encoding="utf-8")


def test_the_table_has_a_row_for_each_run(tmp_path: Path):
    write(make_experiment(tmp_path, ("c1", "a1"), seeds=2))
    with (tmp_path / "table.csv").open() as file:
        rows = list(csv.DictReader(file))
    names = "scene,method,seed,spp,seconds,learn_seconds,train_seconds,infer_seconds,rays"
    assert [*rows[0]] == [*names.split(","), *NAMES]
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
    assert "20% +&ensp;10%" in page  # shares of 3.05 s
    assert "All scenes" not in page


def test_names_from_the_folder_cannot_break_the_page(tmp_path: Path):
    make_experiment(tmp_path)
    evil = "&lt;{{body}}'"
    for old in ("c1/dqn", "c1"):
        (tmp_path / old).rename((tmp_path / old).with_name(evil))
    for path in tmp_path.rglob("result.json"):
        change(path, scene=evil, method=path.parts[-3])
    plan = json.loads((tmp_path / "experiment.json").read_text()) | {"methods": ["uniform", "bsdf", evil], "scenes": [evil]}
    (tmp_path / "experiment.json").write_text(json.dumps(plan))
    page = page_of(tmp_path)
    assert "<title>uniform, bsdf, &amp;lt;{{body}}&#x27; on &amp;lt;{{body}}&#x27;</title>" in page


class _Parsed(HTMLParser):
    """Tags with their attributes, and the text after each tag."""

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
    assert place <= 2  # before everything that it governs: only language and encoding come first
    rules = dict(rule.split(" ", 1) for rule in (policy or "").split("; "))
    for tag, rule in (("script", "script-src"), ("style", "style-src-elem")):
        # A browser does not run scripts of type text/plain, so they need no permission.
        (text,) = [text for (name, a), text in zip(parsed.tags, parsed.texts, strict=True) if name == tag and a.get("type") != "text/plain"]
        assert rules[rule] == f"'sha256-{b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
    assert rules["default-src"] == "'none'"
    assert rules["img-src"] == "data:"
    assert not [name for _, attributes in parsed.tags for name in attributes if name.startswith("on") or name == "href"]
    assert {source[:5] for _, attributes in parsed.tags if (source := attributes.get("src"))} == {"data:"}


def test_a_name_is_no_formula_and_no_markup(tmp_path: Path):
    methods = {"uniform": 0.6, "=1+1": 0.3, "@x": 0.2, "[red]x": 0.1, "_x": 0.1, "$x^$": 0.2}
    found = load(make_experiment(tmp_path, methods=methods, seeds=1))
    rows = list(csv.DictReader(comma_separated(runs(found)).splitlines()))
    assert [row["method"] for row in rows] == ["uniform", "'=1+1", "'@x", "[red]x", "_x", "$x^$"]
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
        show(load(tmp_path), console)
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
