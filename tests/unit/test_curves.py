"""Lines of a chart: means over seeds, where all seeds have values. A chart shows only losses of the same kind."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from blender_rl_guiding.report import curves
from blender_rl_guiding.report.results import Results, Run, Summary


def run(method: str = "dqn", curve: Any = (), losses: Any = (), guide: Any = None) -> Run:
    return Run(
        folder=Path(), scene="c1", method=method, seed=0, spp=4, seconds=1.0, learn_seconds=0.5, rays=1, metrics={},
        settings={"guide": guide or {"kind": "dqn", "error": "squared"}}, machine={}, versions={},
        curve=list(curve), losses=list(losses),
    )  # fmt: skip


def test_errors_are_means_over_seeds_where_all_seeds_have_them():
    first = [{"samples": n, "seconds": float(n), "relmse": 1.0 / n} for n in (1, 2, 4)]
    second = [{"samples": n, "seconds": 3.0 * n, "relmse": 3.0 / n} for n in (2, 4, 8)]
    summary = Summary("dqn", (run(curve=first), run(curve=second)))
    assert curves.over(summary, "samples", "relmse") == [(2, 1.0), (4, 0.5)]
    assert curves.over(summary, "seconds", "relmse") == [(4.0, 1.0), (8.0, 0.5)]
    assert curves.over(summary, "samples", "mape_display") == []


def test_losses_are_means_over_seeds_as_long_as_all_learnt():
    summary = Summary("dqn", (run(losses=[4.0, 2.0, 1.0]), run(losses=[2.0, 0.0])))
    assert curves.losses(summary) == [(1, 3.0), (2, 1.0)]
    assert curves.losses(Summary("dqn", (run(), run(losses=[1.0])))) == []


def test_many_losses_are_means_of_some_steps_each():
    points = curves.losses(Summary("dqn", (run(losses=range(250)),)))
    assert points[:2] == [(5, 2.0), (10, 7.0)]
    assert points[-1] == (250, 247.0)
    assert len(points) == 50
    assert curves.losses(Summary("dqn", (run(losses=range(101)),)))[-1] == (101, 99.5)  # the last mean may be over fewer losses


def test_losses_of_different_kinds_are_apart():
    relative = {"kind": "dqn", "error": "relative"}
    runs = (
        run("a", losses=[1.0]), run("b", losses=[1.0]), run("c", losses=[1.0], guide=relative),
        run("d", losses=[1.0], guide={"kind": "qtable"}), run("e", guide={"kind": "uniform"}),
    )  # fmt: skip
    runs += (replace(runs[0], method="f", settings=runs[0].settings | {"nee": True}),)
    results = Results(Path(), "", ("c1",), tuple("abcdef"), "a", "", "", runs, (), {})
    groups = {unit: [summary.method for summary in found] for unit, found in curves.by_loss(results, "c1").items()}
    assert groups == {
        "squared error": ["a", "b"],
        "relative error": ["c"],
        "loss of qtable": ["d"],
        "squared error with NEE": ["f"],
    }


def test_losses_may_be_anything():
    inf, nan = float("inf"), float("nan")
    summary = Summary("dqn", (run(losses=[inf, 1e308, nan]), run(losses=[-inf, 1e308, 1.0])))
    assert str(curves.losses(summary)) == str([(1, nan), (2, inf), (3, nan)])


@pytest.mark.parametrize("losses", [[1.0], [1.0, float("inf")]])
def test_a_few_losses_stay_as_they_are(losses):
    assert curves.losses(Summary("dqn", (run(losses=losses),))) == list(enumerate(losses, 1))
