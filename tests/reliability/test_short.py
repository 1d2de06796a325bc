"""A short run of each campaign of `./build.sh reliability`, with fixed seeds.

Two campaigns are left out, because they compile for minutes: two cold starts at the same time (`./build.sh reliability starts`), and
damaged kernels.
"""

import os
from pathlib import Path

import pytest

from benchmarks.reliability import bits, bundles, caches, disk, kills, worker, writers
from benchmarks.reliability.guard import Guard
from benchmarks.reliability.trying import trial, tried

SEED = 1


@pytest.fixture
def guard(compiled: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Guard:
    guard = Guard(tmp_path / "guard")
    for name, value in guard.environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.chdir(guard.work)
    return guard


def findings(kind: str, guard: Guard, count: int, **options) -> list[str]:
    """The findings of `count` inputs."""
    used = trial(kind, guard, options)
    try:
        outcomes = list(tried(used, guard, SEED, range(count)))
    finally:
        getattr(used, "end", lambda: None)()
    results = {outcome.result for outcome in outcomes}
    assert len(outcomes) == count
    assert results - {"broken"}, "all are broken"
    if kind in ("bundles", "lines", "settings"):
        assert "refused" in results, "nothing was damaged"
        assert results & {"accepted", "rendered"}, "nothing was whole"
    return [f"{outcome.step}: {outcome.finding}" for outcome in outcomes if outcome.finding]


COUNTS = {"bundles": 120, "settings": 150, "lines": 40, "folders": 5, "caches": 10, "checkpoints": 12}


@pytest.mark.parametrize("kind", COUNTS)
def test_damaged_inputs_are_taken_or_cost_one_line(kind, guard, monkeypatch):
    monkeypatch.setattr(caches, "KERNELS", 0.0)
    assert findings(kind, guard, COUNTS[kind]) == []


def test_damaged_bundles_render_or_cost_one_line(guard, monkeypatch):
    monkeypatch.setattr(bundles, "METHODS", bundles.METHODS[:1])
    assert findings("bundles", guard, 25, every=1, gentle=True) == []


def found(outcomes) -> list[str]:
    """The findings of a campaign without inputs."""
    all_of_them = list(outcomes)
    assert all_of_them
    return [f"{outcome.result}: {outcome.finding}" for outcome in all_of_them if outcome.finding]


def test_a_killed_comparison_loses_nothing(compiled, tmp_path):
    assert found(kills.outcomes(range(1), SEED, tmp_path / "kills", ("compare",), 12)) == []


def test_a_killed_render_loses_nothing(compiled, tmp_path):
    assert found(kills.outcomes(range(1), SEED, tmp_path / "kills", ("render a table",), 24)) == []


def test_one_guide_has_the_same_bits_however_it_is_rendered(compiled, tmp_path):
    step = list(bits.GUIDES).index("dqn encoder=(bspline reads=matrix)")
    assert found(bits.outcomes(range(step, step + 1), SEED, tmp_path / "bits", 12, kills=1)) == []


def test_a_full_disk_costs_one_line(compiled, tmp_path):
    assert found(disk.outcomes(range(4), SEED, tmp_path / "disk", ("render", "compare", "report", "render"))) == []


def test_two_writers_are_kept_apart(compiled, tmp_path):
    assert found(writers.outcomes(range(1), SEED, tmp_path / "writers")) == []


def test_a_worker_goes_on_after_bad_jobs(compiled, tmp_path):
    outcomes = list(worker.outcomes(range(1), SEED, tmp_path / "worker", minute=0.0, least=8))
    assert [outcome.finding for outcome in outcomes] == [""]
    assert outcomes[0].numbers["jobs"] > 0
    assert {"memory", "files", "threads", "temporary"} <= outcomes[0].numbers.keys()


def test_the_surrounding_is_that_of_the_test(guard):
    """The environment variables are those of the test. Otherwise these tests would write into the user's cache."""
    assert os.environ["XDG_CACHE_HOME"] == str(guard.cache)
