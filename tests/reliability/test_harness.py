"""Campaigns find and keep each bad input: one that crashes, hangs, raises, writes elsewhere, prints too much or takes too much."""

import os
import random
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from benchmarks.reliability import __main__ as campaigns
from benchmarks.reliability import fuzzing, mutations, npz, trying, worker
from benchmarks.reliability.commands import difference, digest, leftovers
from benchmarks.reliability.guard import Guard
from benchmarks.reliability.ledger import FoundError, Ledger, Outcome, from_line, line, source
from benchmarks.reliability.trying import tried


@pytest.fixture
def guard(tmp_path: Path) -> Guard:
    return Guard(tmp_path / "guard", tmp_path / "kernels")


def refuse(text: str) -> None:
    raise FloatingPointError(text)  # not InputError, which makes its text printable


def leave_through_link(folder: Path, guard: Guard) -> None:
    (folder / "link").symlink_to(guard.root / "canary")
    (folder / "link" / "table.csv").write_text("x")


def overwrite_through_link(folder: Path, guard: Guard) -> None:
    (folder / "image.exr").symlink_to(guard.root.parent / "elsewhere.txt")
    (folder / "image.exr").write_text("x")


def chmod_through_link(folder: Path, guard: Guard) -> None:
    (folder / "image.exr").symlink_to(guard.root / "canary.txt")
    (folder / "image.exr").chmod(0o600)


# Name: (what a program might do, beginning of the finding).
BAD = {
    "raise": (lambda folder, guard: {}["x"], "traceback: KeyError"),
    "leave": (lambda folder, guard: sys.exit(1), "traceback: SystemExit"),
    "two lines": (lambda folder, guard: refuse("a\nb"), "text"),
    "an escape": (lambda folder, guard: refuse("\x1b[31m"), "text"),
    "half a letter": (lambda folder, guard: refuse("\ud800"), "text"),
    "too long": (lambda folder, guard: refuse("x" * 2000), "text"),
    "nothing": (lambda folder, guard: refuse(""), "text"),
    "warn": (lambda folder, guard: warnings.warn("careful", RuntimeWarning, stacklevel=1), "warning: RuntimeWarning"),
    "a canary": (lambda folder, guard: (guard.root / "canary.txt").write_text("dead"), "write"),
    "a new file": (lambda folder, guard: (guard.root / "new").touch(), "write"),
    "elsewhere": (lambda folder, guard: os.mkdir(guard.root.parent / "elsewhere"), "write: os.mkdir"),
    "rename": (lambda folder, guard: os.replace(guard.root / "canary.txt", folder / "mine"), "write: os.rename"),
    "through a link": (leave_through_link, "write: opened"),
    "over a link": (overwrite_through_link, "write: opened"),
    "chmod a link": (chmod_through_link, "write: os.chmod"),
    "start something": (lambda folder, guard: subprocess.run(["true"]), "write: subprocess.Popen"),
    "unpickle": (lambda folder, guard: npz.Opened().__reduce__()[0](guard.root / "unpickled"), "write: os.mkdir"),
    "take memory": (lambda folder, guard: np.ones(10_000_000), "memory"),
    "differ": (lambda folder, guard: (_ for _ in ()).throw(FoundError("difference: a pixel")), "difference: a pixel"),
}
GOOD = {
    "refuse": lambda folder, guard: refuse("scene.npz: the header is no object"),
    "write inside": lambda folder, guard: (folder / "image.exr").write_bytes(b"x"),
    "temporary": lambda folder, guard: (guard.tmp / "x").write_bytes(b"x"),
    "cache": lambda folder, guard: (guard.cache / "blender_rl_guiding" / "x").write_bytes(b"x"),
    "a link away": lambda folder, guard: ((folder / "x").symlink_to(guard.root.parent), (folder / "x").unlink()),
    "nothing": lambda folder, guard: None,
}


class Doing:
    """A trial that calls a function."""

    def __init__(self, do, guard: Guard) -> None:
        self._do, self._guard = do, guard

    def attempt(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        self._do(folder, self._guard)
        return "accepted", ""


@pytest.mark.parametrize("name", BAD)
def test_what_is_bad_is_found(name, guard, monkeypatch):
    monkeypatch.setattr(trying, "MEMORY", 50 << 20)
    do, finding = BAD[name]
    (outcome,) = tried(Doing(do, guard), guard, 0, [3])
    assert outcome.finding.startswith(finding)
    assert (guard.work / "3").exists(), "the input is gone"


@pytest.mark.parametrize("name", GOOD)
def test_what_is_good_is_not(name, guard):
    (outcome,) = tried(Doing(GOOD[name], guard), guard, 0, [3])
    assert not outcome.finding
    assert not (guard.work / "3").exists()


# A campaign in child processes: input 2 crashes, input 4 hangs.
DEADLY = """
import os, signal, time
from benchmarks.reliability import trying
class Fuzz:
    def __init__(self, guard):
        self.guard = guard
    def attempt(self, rng, folder):
        (folder / "input").write_text(folder.name)
        if folder.name == "2":
            os.kill(os.getpid(), signal.SIGSEGV)
        if folder.name == "4":
            time.sleep(100000)
        if folder.name == "3":
            trying.LIMIT = 5.0  # for input 4 alone: no other input counts as hanging
        return "accepted", ""
"""


def test_a_crash_and_a_hang_are_found_and_the_next_inputs_tried(tmp_path, monkeypatch):
    (tmp_path / "deadly.py").write_text(DEADLY)
    package = Path(fuzzing.__file__).parent
    starter = (
        f"import sys, benchmarks.reliability as p; p.__path__.append({str(tmp_path)!r}); "
        "import benchmarks.reliability.trying as t; t.main(sys.argv[1:])"
    )
    real = subprocess.Popen
    assert package.name == "reliability"

    def popen(command, **options):
        return real([sys.executable, "-c", starter, *command[3:]], **options)

    monkeypatch.setattr(fuzzing.subprocess, "Popen", popen)
    found = list(fuzzing.outcomes("deadly", 0, 0, 6, tmp_path / "out", {}))
    assert [outcome.step for outcome in found] == [0, 1, 2, 3, 4, 5]
    assert {outcome.step: outcome.finding.partition(":")[0] for outcome in found if outcome.finding} == {2: "crash", 4: "hang"}
    assert f"signal {int(signal.SIGSEGV)}" in found[2].finding
    assert [(tmp_path / "out" / str(k) / "input").read_text() for k in (2, 4)] == ["2", "4"]


def test_a_campaign_goes_on_where_it_was(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(campaigns, "CAMPAIGNS", {"writers": campaigns.Campaign("about", 4)})
    tried: list[int] = []

    def outcomes(steps, seed, folder):
        for step in steps:
            tried.append(step)
            if len(tried) == 3:
                raise KeyboardInterrupt
            yield Outcome(step, "accepted", finding="write: too much" if step == 1 else "")

    monkeypatch.setattr("benchmarks.reliability.writers.outcomes", outcomes)
    assert campaigns.main(["writers", "--out", str(tmp_path)]) == 130
    assert campaigns.main(["writers", "--out", str(tmp_path)]) == 1
    assert tried == [0, 1, 2, 2, 3]
    ledger = Ledger(tmp_path, "writers", count=5)
    assert not ledger.next, "another count begins anew"
    assert "write: too much" in capsys.readouterr().out


def test_outcomes_survive_their_line():
    outcome = Outcome(3, "refused", "said \ud800", "text: x", 0.5, {"jobs": 2.0})
    assert from_line(line(outcome)) == outcome


@pytest.mark.parametrize("seed", range(20))
def test_a_seed_does_it_again(seed):
    values, array = {"a": [1, 2.5, "x", None], "b": {"c": True}}, np.arange(12, dtype=np.float32).reshape(4, 3)

    def all_of_them() -> tuple:
        rng = random.Random(seed)
        text = mutations.text(mutations.damaged(values, rng), rng)
        other = npz.damaged_array(array, rng)
        return text, repr(other), mutations.damaged_bytes(b"x" * 100, rng), npz.archive({"a": array, "b": array}, rng)

    with np.errstate(all="ignore"):
        assert all_of_them() == all_of_them()


def test_damage_reaches_every_part():
    values = {"a": [1, 2.5, "x", None], "b": {"c": True}}
    made = [mutations.damaged(values, random.Random(seed), times=1) for seed in range(2000)]
    for place in list(mutations.places(values))[1:]:

        def other(new, place=place) -> bool:
            try:
                return mutations.at(new, place) != mutations.at(values, place)
            except (KeyError, IndexError, TypeError):
                return True

        assert sum(map(other, made)) > 50


def test_differences_and_leftovers_are_seen(tmp_path):
    (tmp_path / "result.json").write_text('{"spp": 2, "seconds": 3.0}')
    before = digest(tmp_path)
    (tmp_path / "result.json").write_text('{"spp": 2, "seconds": 4.0}')
    assert not difference(digest(tmp_path), before)
    (tmp_path / "result.json").write_text('{"spp": 3, "seconds": 3.0}')
    assert difference(digest(tmp_path), before) == "result.json differs"
    for name in (".image.123.exr", "checkpoint.npz", "checkpoint-0001.npz", ".lock"):
        (tmp_path / name).touch()
    assert sorted(leftovers(tmp_path)) == [".image.123.exr", "checkpoint-0001.npz", "checkpoint.npz"]


def minutes(slope: float, count: int = 60, process: int = 7, first: float = 300.0) -> list[dict[str, float]]:
    """Measurements of a worker, one per minute. Its memory grows by `slope` MiB per hour."""
    rng = np.random.default_rng(0)
    others: dict[str, float] = {"jobs": 3, "files": 9, "threads": 5, "temporary": 0, "process": process}
    return [{"step": k, "memory": first + slope * k / 60 + rng.normal()} | others for k in range(count)]


@pytest.mark.parametrize(("slope", "grows"), [(0.0, False), (3.0, False), (60.0, True)])
def test_growth_is_a_finding(slope, grows, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(worker, "outcomes", lambda steps, *_: (Outcome(k, "minute", numbers=minutes(slope)[k]) for k in steps))
    assert campaigns.main(["worker", "--out", str(tmp_path)]) == grows
    assert ("worker: growth: memory by" in capsys.readouterr().out) == grows


def test_growth_is_that_of_one_process():
    rows = [*minutes(0.0, 30, process=1, first=100.0), *[row | {"step": row["step"] + 30} for row in minutes(0.0, 30, first=300.0)]]
    assert not worker.verdict(rows)
    assert worker.verdict([row | {"process": 1} for row in rows])


@pytest.mark.parametrize(("went_on", "idle"), [(0, True), (3, True), (12, False)])
def test_kills_that_meet_no_checkpoint_are_a_finding(went_on, idle, tmp_path, monkeypatch):
    numbers = {"ended": 1, "renders": 1}
    made = (Outcome(k, "render", numbers=numbers | {"went on": int(k < went_on)}) for k in range(20))
    monkeypatch.setattr("benchmarks.reliability.kills.outcomes", lambda *_: made)
    assert campaigns.main(["kills", "--count", "20", "--out", str(tmp_path)]) == idle


def test_another_source_is_another_campaign(tmp_path):
    (tmp_path / "addon").mkdir()
    seen = {source(tmp_path)}
    for text in ("a = 1", "a = 2", "a = 22"):  # committed or not
        (tmp_path / "addon" / "a.py").write_text(text)
        seen.add(source(tmp_path))
    assert len(seen) == 4
