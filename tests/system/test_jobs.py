"""Runs at the same time give the same results as runs in turn. A line tells a failed run, and the others go on."""

import io
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blender_rl_guiding.comparison import Comparison
from blender_rl_guiding.doors.worker import Events
from blender_rl_guiding.experiments import runner
from blender_rl_guiding.experiments.pool import Outcome, perform_all, threads_each
from blender_rl_guiding.experiments.runs import RENDERED, Judge, Task
from blender_rl_guiding.images import read_exr, write_exr
from blender_rl_guiding.scene.data import SceneData
from blender_rl_guiding.scene.description import Closure, Shader
from blender_rl_guiding.settings import BSDF, Machine, Render
from tests import scenes
from tests.patience import PATIENCE
from tests.system.small import SMALL

METHODS = ["--methods", "uniform,dqn", "--spp", 4, "--seeds", 2, "--reference-spp", 128, *SMALL, "--dqn.cells", 3]


def results(folder: Path) -> dict[str, dict]:
    """The result.json of each run, without values that depend on the clock or on the number of threads."""
    found = {}
    for path in folder.rglob("result.json"):
        values = json.loads(path.read_text())
        curve = [{k: v for k, v in entry.items() if not k.endswith("seconds")} for entry in values["curve"]]
        timed = {"seconds", "learn_seconds", "machine", "curve", "sha256"}
        found[str(path.relative_to(folder))] = {k: v for k, v in values.items() if k not in timed} | {"curve": curve}
    return found


def test_jobs_change_no_bit(rlg, bundle, tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    assert rlg("compare", bundle, *METHODS, "--out", one).returncode == 0
    done = rlg("compare", bundle, *METHODS, "--out", two, "--jobs", 2)
    assert done.returncode == 0
    assert "(4 of 4)" in done.stderr
    assert results(one) == results(two)
    assert len(results(one)) == 4
    assert all((values["probe"] is not None) == (values["method"] == "dqn") for values in results(two).values())
    for path in one.rglob("image.exr"):
        np.testing.assert_array_equal(read_exr(path)[0], read_exr(two / path.relative_to(one))[0])


def test_errors_are_recorded_at_powers_of_two_and_losses_at_each_step(rlg, bundle, tmp_path):
    assert rlg("compare", bundle, *METHODS, "--seeds", 1, "--out", tmp_path / "out").returncode == 0
    found = {values["method"]: values for values in results(tmp_path / "out").values()}
    assert [entry["samples"] for entry in found["uniform"]["curve"]] == [1, 2, 4]
    assert [entry["samples"] for entry in found["dqn"]["curve"]] == [1, 2, 3, 4]
    for values in found.values():
        last = values["curve"][-1]
        assert {name: last[name] for name in ("mape_display", "relmse")}.items() <= values["metrics"].items()
        assert values["curve"][0]["relmse"] > last["relmse"] > 0
    assert found["uniform"]["losses"] == []
    assert len(found["dqn"]["losses"]) >= sum("loss" in entry for entry in found["dqn"]["curve"]) > 0


def test_memory_is_asked_for_the_runs_that_are_due(compiled: None, tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(runner, "forewarn", lambda scene, methods, machine, at_once: asked.append((scene.name, methods, at_once)))
    brief, longer = Render(spp=1, guide=BSDF()), Render(spp=2, guide=BSDF())
    names = "one", "two"
    truth = tmp_path / "grey.exr"
    write_exr(truth, np.full((4, 4, 3), 0.5, np.float32), {})
    progress = Events(io.StringIO()).bar

    def run(jobs: int, scene: str, seeds: int, **methods: Render) -> None:
        room = replace(scenes.tiny(4), name=scene)
        asked = Comparison(tuple(methods.items()), budget="EACH", seeds=seeds, reference="FILE", reference_file=truth)
        plan = runner.Experiment(tmp_path / scene, (room,), asked, "test")
        assert runner.run([plan], Machine(), jobs, progress) == 0

    for name in names:
        run(1, name, 2, brief=brief)
    assert [(name, at_once) for name, _, at_once in asked] == [("one", 1), ("two", 1)]
    monkeypatch.setattr(runner, "_perform", lambda *given: 0)
    asked.clear()
    run(8, "one", 2, brief=brief, longer=longer)
    assert [(name, [settings.spp for settings in methods], at_once) for name, methods, at_once in asked] == [("one", [2], 2)]
    asked.clear()
    run(8, "two", 2, brief=brief)
    assert asked == []


def test_threads_are_shared():
    assert threads_each(Machine(threads=8), 3) == 2
    assert threads_each(Machine(threads=2), 3) == 1
    assert threads_each(Machine(), 1) == os.cpu_count()


def blinding() -> SceneData:
    """A light behind a sheet. The sheet multiplies the light by a factor that overflows single precision."""
    b = scenes.Builder()
    b.quad((-0.9, 1, -0.3), (-0.6, 1, -0.3), (-0.6, 1, -0.1), (-0.9, 1, -0.1), scenes.material("sun", emission=(1e37, 1e37, 1e37)))
    b.quad((-9, 0.5, -9), (9, 0.5, -9), (9, 0.5, 9), (-9, 0.5, 9), Shader("sheet", (), (Closure("transparent", 100.0),)))
    return b.scene(scenes.look((0, 0, 0), (0, 1, 0), 90, 8, 8))


class Deadly:
    """An object that ends the process that unpickles it."""

    def __reduce__(self):
        return os._exit, (3,)


def task(folder: Path, scene: SceneData, method: str, truth=None) -> Task:
    judge = Judge(np.ones((8, 8, 3), np.float32) if truth is None else truth, RENDERED)
    return Task(folder / method, scene, Render(spp=2), method, judge, forewarned=True)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_run_that_fails_ends_no_other(compiled, tmp_path, jobs):
    tiny = scenes.tiny(8)
    tasks = [task(tmp_path, blinding(), "blinding"), task(tmp_path, tiny, "a"), task(tmp_path, tiny, "b"), task(tmp_path, tiny, "c")]
    ended, paces = {}, []
    perform_all(tasks, Machine(), jobs, lambda task, pace: paces.append(pace), lambda task, outcome: ended.update({task.method: outcome}))
    assert ended.keys() == {"blinding", "a", "b", "c"}
    assert ended["blinding"].seconds is None
    assert ended["blinding"].text.endswith("received radiance that is not a finite number")
    assert all(ended[name].seconds for name in "abc")
    assert {str(path.parent.name) for path in tmp_path.rglob("result.json")} == {"a", "b", "c"}
    assert max(pace.share for pace in paces) == 1.0


def test_a_process_that_dies_is_replaced(compiled, tmp_path):
    tiny = scenes.tiny(8)
    tasks = [task(tmp_path, tiny, "deadly", truth=Deadly()), *(task(tmp_path, tiny, name) for name in "abc")]
    ended: dict[str, Outcome] = {}
    perform_all(tasks, Machine(), 2, lambda task, pace: None, lambda task, outcome: ended.update({task.method: outcome}))
    assert ended["deadly"] == Outcome("its process ended with status 3: it gave no reason", None)
    assert all(ended[name].seconds for name in "abc")


def test_failed_runs_are_named_reported_missing_and_the_status_tells(rlg, tmp_path, monkeypatch):
    from blender_rl_guiding.experiments import produce
    from blender_rl_guiding.scene.bundle import save

    def failing(*args, **kwargs):
        if args[1].guide.kind == "uniform":
            raise FloatingPointError("pixel (1, 2) is odd")
        return render(*args, **kwargs)

    render = produce.render
    monkeypatch.setattr(produce, "render", failing)
    save(scenes.tiny(8), tmp_path / "tiny.npz")
    done = rlg("compare", tmp_path / "tiny.npz", "--methods", "bsdf,uniform", "--spp", 2, "--reference-spp", 1, "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "tiny uniform seed 0: FAILED: pixel (1, 2) is odd" in done.stderr
    assert done.stderr.splitlines()[-1] == "rlg: 1 of the runs failed, as told above; the same command tries them again"
    assert "<li>tiny/uniform/seed-0</li>" in (tmp_path / "out" / "report.html").read_text()


MASKS = """
import signal
from pathlib import Path
from blender_rl_guiding.experiments import runner
from blender_rl_guiding.experiments.pool import _workers
from blender_rl_guiding.settings import Machine
with _workers(2, Machine(threads=1)) as workers:
    for worker in workers:
        print(int(Path(f"/proc/{worker.process.pid}/status").read_text().partition("SigBlk:")[2].split()[0], 16) >> signal.SIGINT - 1 & 1)
"""


def test_ctrl_c_reaches_no_child():
    """It does not even reach the first child. Before this child, Python starts a process that unblocks the signal."""
    done = subprocess.run([sys.executable, "-c", MASKS], capture_output=True, text=True, check=True, timeout=PATIENCE)
    assert done.stdout.split() == ["1", "1"]


PARENT = """
import multiprocessing, sys
from pathlib import Path
from blender_rl_guiding.experiments import runner
from blender_rl_guiding.experiments.pool import perform_all
from blender_rl_guiding.settings import Machine
from tests import scenes
from tests.system.test_jobs import endless, task

if __name__ == "__main__":
    tasks = [endless(task(Path(sys.argv[1]), scenes.tiny(8), name)) for name in "ab"]
    def on_pace(task, pace):
        print("children", *(child.pid for child in multiprocessing.active_children()), flush=True)
    perform_all(tasks, Machine(), 2, on_pace, lambda task, outcome: None)
"""


def endless(task: Task) -> Task:
    """The task with so many samples that it does not end within a test."""
    return replace(task, settings=replace(task.settings, spp=1_000_000))


def test_no_process_outlives_one_that_is_killed(compiled, tmp_path):
    script = tmp_path / "parent.py"  # children import this file
    script.write_text(PARENT)
    variables = os.environ | {"PYTHONPATH": str(Path(__file__).resolve().parents[2])}
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, str(script), str(tmp_path)], env=variables, stdout=pipe, stderr=pipe, text=True) as parent:
        assert parent.stdout
        children = next(line.split()[1:] for line in parent.stdout if line.startswith("children "))
        assert len(children) == 2
        parent.kill()
        _, said = parent.communicate(timeout=PATIENCE)  # waits until no process has the pipe open
    assert said == ""
