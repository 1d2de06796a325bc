"""The estimate of a sweep: by runs of the same method on the same scene, else of the method, else of any."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from blender_rl_guiding.experiments.forecast import Forecast
from blender_rl_guiding.experiments.runs import RENDERED, Judge
from blender_rl_guiding.experiments.tasks import Outcome, Task
from blender_rl_guiding.settings import Render


def task(scene: str, method: str) -> Task:
    return Task(Path(), SimpleNamespace(name=scene), Judge(np.zeros(0), RENDERED), method, Render())


def test_runs_to_come_are_weighed_by_those_alike():
    tasks = [task("a1", "dqn"), task("a1", "uniform"), task("a1", "dqn"), task("c1", "dqn"), task("c1", "bsdf")]
    forecast = Forecast(tasks, jobs=2)
    assert (forecast.done, forecast.total, str(forecast)) == (0, 5, "0 of 5")  # nothing is known: a second each
    forecast.share(tasks[0], 0.5)
    assert (forecast.done, forecast.total) == (0.5, 5)
    forecast.end(tasks[0], Outcome("", 100.0))
    forecast.end(tasks[1], Outcome("", 20.0))
    assert forecast.done == 120
    assert forecast.total == 120 + 100 + 100 + 60  # known, of the method, of any
    assert str(forecast) == "2 of 5, about 0:02:10 to go"  # two at a time
    forecast.share(tasks[3], 0.25)
    assert forecast.done == pytest.approx(120 + 25)


def test_a_failed_run_teaches_nothing_and_is_over():
    tasks = [task("a1", "dqn"), task("a1", "dqn")]
    forecast = Forecast(tasks, jobs=1)
    forecast.end(tasks[0], Outcome("it broke", None))
    assert (forecast.done, forecast.total, str(forecast)) == (0, 1, "1 of 2")
    forecast.end(tasks[1], Outcome("", 7.0))
    assert (forecast.done, forecast.total, str(forecast)) == (7, 7, "2 of 2")
