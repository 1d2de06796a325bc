"""A render ends after its samples, after its time, or when its noise is below the limit. All pixels are finite."""

import itertools
from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest

from blender_rl_guiding.guiding.base import Guide, OnStep, Transitions, unheard
from blender_rl_guiding.guiding.dqn import DQNGuide
from blender_rl_guiding.render import Result, render, renderer
from blender_rl_guiding.render.noise import LEAST_SAMPLES
from blender_rl_guiding.render.passes import PassTracer
from blender_rl_guiding.scene.description import Closure, Instruction, Node, Shader
from blender_rl_guiding.scene.faults import find_fault
from blender_rl_guiding.settings import DQN, Machine, Render
from blender_rl_guiding.settings import Guide as AnyGuide
from tests import scenes

MACHINE = Machine(batch=1024)
SMALL = DQN(layers=1, rows=2, columns=3, learning_starts=64, batch=64, first_steps=2, steps=1)


def samples_after(scene, settings: Render) -> tuple[Result, list[float]]:
    """(result, number of samples after each pass, from `on_pass`)."""
    told = []
    result = render(scene, settings, MACHINE, lambda state: told.append(state.film.samples))
    assert told == [entry["samples"] for entry in result.curve]
    return result, told


def test_all_samples_are_taken_in_passes_that_double():
    result, told = samples_after(scenes.tiny(8), Render(spp=100))
    assert told == [1, 2, 4, 8, 16, 32, 64, 100]
    assert (result.film.counts == 100).all()
    assert result.finished
    assert result.seconds > 0


def test_long_passes_still_end_at_powers_of_two(monkeypatch):
    monkeypatch.setattr(renderer, "PATHS_PER_PASS", 7 * 8 * 8)
    assert samples_after(scenes.tiny(8), Render(spp=18))[1] == [1, 2, 4, 8, 12, 16, 18]
    monkeypatch.setattr(renderer, "PATHS_PER_PASS", 10)  # less than one sample
    assert samples_after(scenes.tiny(8), Render(spp=3))[1] == [1, 2, 3]


class Clock:
    """Stands in for the module `time`. Only `sleep` moves it."""

    def __init__(self) -> None:
        self.now = 1000.0

    def perf_counter(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds


def test_time_counts_tracing_and_learning_and_not_what_the_caller_does(monkeypatch):
    clock, trace, learn = Clock(), PassTracer.trace, DQNGuide.learn
    monkeypatch.setattr(renderer, "time", clock)
    monkeypatch.setattr(PassTracer, "trace", lambda *args: (clock.sleep(1), trace(*args))[1])
    monkeypatch.setattr(DQNGuide, "learn", lambda *args: (clock.sleep(10), learn(*args))[1])
    result = render(scenes.tiny(8), Render(spp=3, guide=SMALL), MACHINE, lambda state: clock.sleep(1000))
    assert [entry["seconds"] for entry in result.curve] == [11, 22, 23]
    assert (result.seconds, result.learn_seconds) == (23, 20)


def test_what_the_caller_does_does_not_use_up_the_time_limit(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(renderer, "time", clock)
    result = render(scenes.tiny(8), Render(spp=20, seconds=1), MACHINE, lambda state: clock.sleep(1000))
    assert result.film.samples == 20


class Told(Guide):
    """A guide that learns nothing, and returns given numbers from `learn`."""

    def __init__(self, *told: dict[str, Any]) -> None:
        self._told = iter(told)

    def wanted(self) -> int:
        return 10

    def learn(self, transitions: Transitions, on_step: OnStep = unheard) -> dict[str, Any]:
        return next(self._told)


def test_losses_of_training_steps_are_gathered_beside_the_curve(monkeypatch):
    guide = Told({}, {"loss": 2.0, "losses": [3.0, 1.0], "train_seconds": 0.5}, {"loss": 0.5, "losses": [0.5]})
    monkeypatch.setattr(renderer, "make_guide", lambda *args: guide)
    result = render(scenes.tiny(8), Render(spp=4), MACHINE)
    assert result.losses == [3.0, 1.0, 0.5]
    assert [entry.get("loss") for entry in result.curve] == [None, 2.0, 0.5, None]
    assert result.curve[1]["train_seconds"] == 0.5
    assert not any("losses" in entry for entry in result.curve)


def test_a_pass_that_tells_one_loss_is_one_step(monkeypatch):
    monkeypatch.setattr(renderer, "make_guide", lambda *args: Told({"loss": 2.0}, {"loss": 1.0}))
    assert render(scenes.tiny(8), Render(spp=3), MACHINE).losses == [2.0, 1.0]


def test_a_guide_learns_after_every_sample_but_the_last():
    result, told = samples_after(scenes.tiny(16), Render(spp=4, guide=SMALL))
    assert told == [1, 2, 3, 4]
    assert ["loss" in entry for entry in result.curve] == [True, True, True, False]


def test_a_time_limit_ends_the_render_after_a_pass():
    result, told = samples_after(scenes.tiny(8), Render(spp=1000, seconds=1e-6))
    assert told == [1]
    assert result.finished
    assert samples_after(scenes.tiny(8), Render(spp=10, seconds=1e6))[1] == [1, 2, 4, 8, 10]


def half_noisy(size: int = 16):
    """A wall. Its left half emits a constant radiance. A screen behind the camera lights its right half."""
    b = scenes.Builder()
    b.quad((-9, 1, -9), (0, 1, -9), (0, 1, 9), (-9, 1, 9), scenes.material("even", emission=(1.0, 1.0, 1.0)))
    b.quad((0, 1, -9), (9, 1, -9), (9, 1, 9), (0, 1, 9), scenes.material("grey", (0.5, 0.5, 0.5)))
    b.quad((-2, -1, -2), (2, -1, -2), (2, -1, 2), (-2, -1, 2), scenes.material("screen", emission=(1.0, 1.0, 1.0)))
    return b.scene(scenes.look((0, 0, 0), (0, 1, 0), 90, size, size), max_bounces=1)


def test_only_noisy_pixels_are_sampled_on():
    result, _ = samples_after(half_noisy(), Render(spp=64, nee=False, noise=0.01))
    counts = result.film.counts
    assert (counts[:, :6] == LEAST_SAMPLES).all()  # these pixels have no noisy neighbours
    assert (counts[:, 9:] == 64).all()
    assert result.finished


def test_a_pixel_is_sampled_until_it_is_quiet():
    """The pixel's samples equal the first samples of a render without a noise limit."""
    settings, seen = Render(spp=4096, nee=False, noise=0.05), []
    result = render(half_noisy(8), settings, MACHINE, lambda state: seen.append((state.film.noise(), state.film.counts.copy())))
    assert LEAST_SAMPLES < result.film.samples < settings.spp
    assert (result.film.noise() <= settings.noise).all()
    told = [entry["samples"] for entry in result.curve]
    for (noise, counts), (_, later) in itertools.pairwise(seen[told.index(LEAST_SAMPLES) :]):
        assert (later > counts)[noise > settings.noise].all()
    unbroken = render(half_noisy(8), replace(settings, noise=0.0, spp=result.film.samples), MACHINE).film
    most = result.film.counts == result.film.samples
    np.testing.assert_array_equal(result.image[most], unbroken.mean()[most])


def test_a_threshold_that_all_pixels_meet_ends_the_render():
    result, told = samples_after(half_noisy(), Render(spp=64, nee=False, noise=1.0))
    assert told == [1, 2, 4, 8, 12, 16]
    assert result.finished


@pytest.mark.parametrize("guide", [Render().guide, SMALL], ids=lambda guide: guide.kind)
@pytest.mark.parametrize("gain", [1.0, 100.0])
def test_what_is_not_a_number_is_refused_by_pixel(gain, guide):
    """Two pixels see a light through a sheet. The sheet multiplies the light by a factor that overflows single precision."""
    b = scenes.Builder()
    b.quad((-0.9, 1, -0.3), (-0.6, 1, -0.3), (-0.6, 1, -0.1), (-0.9, 1, -0.1), scenes.material("sun", emission=(1e37, 1e37, 1e37)))
    b.quad((-9, 0.5, -9), (9, 0.5, -9), (9, 0.5, 9), (-9, 0.5, 9), Shader("sheet", (), (Closure("transparent", gain),)))
    scene = b.scene(scenes.look((0, 0, 0), (0, 1, 0), 90, 8, 8))
    if gain == 1:
        assert np.isfinite(render(scene, Render(spp=2, nee=False, guide=guide), MACHINE).image).all()
        return
    with pytest.raises(FloatingPointError, match=r"^pixel \([01], [45]\) received radiance that is not a finite number$"):
        render(scene, Render(spp=2, nee=False, guide=guide), MACHINE)


# --- nothing to see, nothing to learn --------------------------------------------------------------------------------

GREY = (0.5, 0.25, 1.0)
PLAIN = {
    "dark and empty": (scenes.empty(4), (0.0, 0.0, 0.0)),
    "empty": (scenes.empty(4, GREY), GREY),
    "dark": (
        replace(scenes.tiny(4), world=scenes.sky((0.0, 0.0, 0.0)), shaders=(scenes.material("grey", GREY),) * 9, lamps=()),
        (0.0,) * 3,
    ),
}


def test_attributes_of_no_object():
    """The exporter gives such a scene if it cannot read the only object with attributes."""
    bump = Instruction("bump", (Node(0), 1.0, 1.0, Node(1)), options=(0,))
    shader = Shader("bumpy", (Instruction("attribute", options=(0,)), Instruction("normal"), bump), ())
    rows = np.zeros((1, 0), np.int64)
    scene = replace(scenes.empty(4, GREY), shaders=(shader,), attribute_rows=rows, visibility=np.zeros(0, np.uint8))
    assert find_fault(scene) == ""
    assert render(scene, Render(spp=1), MACHINE).image == pytest.approx(np.broadcast_to(GREY, (4, 4, 3)))


@pytest.mark.parametrize("guide", get_args(AnyGuide))
@pytest.mark.parametrize("name", PLAIN)
def test_plain_images_of_all_guides(name: str, guide: type):
    scene, color = PLAIN[name]
    for nee in (False, True):
        result = render(scene, Render(spp=4, guide=guide(), nee=nee, passes=True), MACHINE)
        assert result.image == pytest.approx(np.broadcast_to(color, (4, 4, 3)))
