"""An encoder's gain: it is compared with the right method, has the right interval, and nothing is claimed within the interval."""

import json
from pathlib import Path

import pytest

from blender_rl_guiding.report import load
from blender_rl_guiding.report.gains import gains
from blender_rl_guiding.report.numbers import margin, times
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
    """Runs with the errors of ERRORS. Their networks have different encoders; the network of `wider` also has another width."""
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
    assert [(row.name, row.cells[0].text) for row in found] == [(name, "plain") for name in ("better", "alike", "worse")]
    summaries = {summary.method: summary.errors["mape_display"] for summary in results.summaries("c1")}
    ratios = [ratio_of(summaries[row.name], summaries["plain"]) for row in found]
    assert [row.cells[1] for row in found] == [(times(ratio.mean), (margin(ratio),), None, None) for ratio in ratios]


@pytest.mark.parametrize(
    ("half", "verdicts"),
    [(0.001, ["better, by 40.8% at least", "worse, by 82.0% at least"]), (0.1, ["no difference beyond the interval"] * 2)],
)
def test_only_what_lies_beyond_the_interval_counts(half: float, verdicts: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Two errors that differ by 2 `half` have the interval 12.706 `half`. With half = 0.001 it is 0.0127: .11 / .21 is .524 +- .068,
    and .41 / .21 is 1.952 +- .133.
    """
    monkeypatch.setattr(f"{__name__}.ERRORS", {name: (sum(pair) / 2 - half, sum(pair) / 2 + half) for name, pair in ERRORS.items()})
    better, _, worse = gains(experiment(tmp_path), "c1")
    assert [better.cells[2].text, worse.cells[2].text] == verdicts


def test_one_seed_tells_nothing(tmp_path: Path):
    assert {row.cells[2].text for row in gains(experiment(tmp_path, seeds=1), "c1")} == {"more seeds would tell"}


def test_the_page_has_the_table_where_there_is_something_to_compare(tmp_path: Path):
    text = page(experiment(tmp_path / "some"))
    part = text[text.index("<h2>Encoders") :]
    assert part.count("<td>plain</td>") == 3
    assert "no difference beyond the interval" in part
    assert "<h2>Encoders" not in page(load(make_experiment(tmp_path / "none")))
