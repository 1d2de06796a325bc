"""The estimate of a sweep's time, by finished runs: of the same method and scene, else of the method, else of its kind of guide."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from blender_rl_guiding.experiments.forecast import Forecast
from blender_rl_guiding.experiments.pool import Outcome
from blender_rl_guiding.experiments.runs import Task
from blender_rl_guiding.pace import Pace
from blender_rl_guiding.settings import DQN, QTable, Render, Uniform

GUIDES = {"dqn": DQN(), "small": DQN(width=8), "uniform": Uniform(), "qtable": QTable()}


def task(scene: str, method: str) -> Task:
    settings = Render(guide=GUIDES[method]) if method in GUIDES else Render()
    return Task(Path(), SimpleNamespace(name=scene), settings, method)


def test_runs_to_come_are_weighed_by_those_alike():
    tasks = [task("a1", "dqn"), task("a1", "uniform"), task("a1", "dqn"), task("c1", "dqn"), task("c1", "bsdf"), task("c1", "small")]
    forecast = Forecast(tasks, jobs=2)
    assert (forecast.done, forecast.total, str(forecast)) == (0, 6, "0 of 6")  # nothing is known: one second per run
    forecast.go(tasks[0], Pace(40.0, 40.0))
    assert (forecast.done, forecast.total) == (40, 80 + 5)
    forecast.end(tasks[0], Outcome("", 100.0))
    forecast.end(tasks[1], Outcome("", 20.0))
    assert forecast.done == 120
    assert forecast.total == 120 + 100 + 100 + 20 + 100  # known; by the method; by guides that do not learn; by the guide
    assert str(forecast) == "2 of 6, about 0:02:40 to go"  # two runs at the same time
    forecast.go(tasks[3], Pace(15.0, 45.0))
    assert forecast.done == pytest.approx(120 + 15)
    assert str(forecast) == "2 of 6, about 0:02:12 to go"


def test_learning_is_not_weighed_by_what_does_not_learn():
    tasks = [task("c1", "uniform"), task("c1", "bsdf"), task("c1", "dqn"), task("c1", "qtable")]
    forecast = Forecast(tasks, jobs=1)
    forecast.end(tasks[0], Outcome("", 4.0))
    assert str(forecast) == "1 of 4, about 0:00:04 to go and dqn, qtable, whose learning has not been timed yet"
    forecast.end(tasks[1], Outcome("", 2.0))
    assert str(forecast) == "2 of 4, to go: dqn, qtable, whose learning has not been timed yet"
    forecast.go(tasks[2], Pace(0.9, 89.1))
    assert forecast.total == 6 + 90 + 3
    forecast.end(tasks[2], Outcome("", 98.0))
    assert str(forecast) == "3 of 4, to go: qtable, whose learning has not been timed yet"


def test_a_failed_run_teaches_nothing_and_is_over():
    tasks = [task("a1", "dqn"), task("a1", "dqn")]
    forecast = Forecast(tasks, jobs=1)
    forecast.end(tasks[0], Outcome("it broke", None))
    assert (forecast.done, forecast.total, str(forecast)) == (0, 1, "1 of 2")
    forecast.end(tasks[1], Outcome("", 7.0))
    assert (forecast.done, forecast.total, str(forecast)) == (7, 7, "2 of 2")
