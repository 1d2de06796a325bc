"""An encoder's gain: against the right method, with the right interval, and no claim beyond the interval."""

import json
from pathlib import Path

import pytest

from blender_rl_guiding.report.folders import load
from blender_rl_guiding.report.gains import gains
from blender_rl_guiding.report.page import page
from blender_rl_guiding.report.results import Results, ratio_of
from tests.unit.test_report import make_experiment

ERRORS = {
    "bsdf": (0.3, 0.3),
    "plain": (0.20, 0.22),
    "better": (0.10, 0.12),
    "alike": (0.19, 0.21),
    "worse": (0.40, 0.42),
    "wider": (0.1, 0.1),
}


def experiment(folder: Path, seeds: int = 2) -> Results:
    """Runs with the errors of ERRORS. Their networks differ in the encoder; `wider` differs in its width, too."""
    make_experiment(folder, methods=dict.fromkeys(("uniform", *ERRORS), 0.3), seeds=seeds)
    for method, errors in ERRORS.items():
        for seed in range(seeds):
            path = folder / "c1" / method / f"seed-{seed}" / "result.json"
            result = json.loads(path.read_text())
            result["metrics"]["mape_display"] = errors[seed]
            if method != "bsdf":
                encoder = {"kind": "none"} if method == "plain" else {"kind": "rbf", "sigma": 1.0}
                result["settings"]["guide"] = {"kind": "dqn", "width": 200 if method == "wider" else 100, "encoder": encoder}
            path.write_text(json.dumps(result))
    return load(folder)


def test_encoders_are_held_against_the_same_network_without(tmp_path: Path):
    results = experiment(tmp_path)
    found = gains(results, "c1")
    assert [(gain.method, gain.plain) for gain in found] == [(name, "plain") for name in ("better", "alike", "worse")]
    summaries = {summary.method: summary.errors["mape_display"] for summary in results.summaries("c1")}
    assert all(gain.ratio == ratio_of(summaries[gain.method], summaries["plain"]) for gain in found)


@pytest.mark.parametrize(
    ("half", "verdicts"),
    [(0.001, ["better, by 40.8% at least", "worse, by 82.0% at least"]), (0.1, ["no difference beyond the interval"] * 2)],
)
def test_only_what_lies_beyond_the_interval_counts(half: float, verdicts: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Errors 2 `half` apart: interval 12.706 `half`, 0.0127. So .11 / .21 is .524 +- .068, and .41 / .21 is 1.952 +- .133."""
    monkeypatch.setattr(f"{__name__}.ERRORS", {name: (sum(pair) / 2 - half, sum(pair) / 2 + half) for name, pair in ERRORS.items()})
    better, _, worse = gains(experiment(tmp_path), "c1")
    assert [better.verdict, worse.verdict] == verdicts


def test_one_seed_tells_nothing(tmp_path: Path):
    assert {gain.verdict for gain in gains(experiment(tmp_path, seeds=1), "c1")} == {"more seeds would tell"}


def test_the_page_has_the_table_where_there_is_something_to_compare(tmp_path: Path):
    text = page(experiment(tmp_path / "some"))
    part = text[text.index("<h2>Encoders") :]
    assert part.count("<td>plain</td>") == 3
    assert "no difference beyond the interval" in part
    assert "<h2>Encoders" not in page(load(make_experiment(tmp_path / "none")))
