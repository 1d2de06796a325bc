"""The one entry: passes over the image, each learnt from before the next."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..guiding import make_guide
from ..guiding.base import Guide, Transitions
from ..scene.data import SceneData
from ..scene.description import IDENTITY, Bounces, Camera, Closure, Instruction, Node, Shader
from ..settings import DQN, Machine, QTable, Render
from ..settings import Guide as GuideSettings
from .film import Film
from .needs import require
from .passes import PassTracer
from .stage import wants_passes

PATHS_PER_PASS = 1 << 20  # at most, of a guide that does not learn
CHECKED_EVERY = 4  # samples between two looks at the clock or the noise, at most
TOLD_EVERY = 0.1  # seconds between two calls of `on_step`, at least
LEAST_SAMPLES = 16  # before the noise of a pixel is believed


@dataclass
class Result:
    """What a render has to show so far; after an interrupt `film` holds those samples of the pass under way that were taken, too."""

    film: Film
    guide: Guide  # as far as it has learnt
    seconds: float = 0.0  # wall time of tracing and learning
    learn_seconds: float = 0.0
    steps: int = 0  # of training
    rays: int = 0  # closest-hit and shadow rays
    curve: list[dict[str, float]] = field(default_factory=list)  # one entry a pass: samples, seconds, loss, ...
    losses: list[float] = field(default_factory=list)  # one for each training step
    finished: bool = False  # whether it ended as its settings say

    @property
    def image(self) -> np.ndarray:
        """(height, width, 3) float32, linear, top row first."""
        return self.film.mean()


def render(
    scene: SceneData,
    settings: Render,
    machine: Machine = Machine(),  # noqa: B008  # frozen
    on_pass: Callable[[Result], None] | None = None,
    on_step: Callable[[Result], None] | None = None,
) -> Result:
    """Render a scene. Scene, settings and the machine's floating-point unit decide every bit of the image; `machine` does not.

    `on_pass` is called after every pass with the state so far, and may add to the curve's last entry; its time does not count. What it
    raises ends the render at once. `on_step` is called now and then while a guide trains, which may take longer than all passes.
    """
    require(scene, settings, machine)
    guide = make_guide(settings.guide, scene, settings.seed)
    tracer = PassTracer(scene, settings, machine, learning=guide.wanted() > 0)
    film = Film(scene.camera.width, scene.camera.height, scene.film.exposure, wants_passes(scene, settings))
    result = Result(film, guide)
    pixels = np.arange(scene.camera.width * scene.camera.height)
    start = time.perf_counter()
    for first, count in _rounds(settings, len(pixels), learning=guide.wanted() > 0):
        transitions = tracer.trace(guide.directions(), film, pixels, first, count, guide.wanted())
        result.rays = tracer.rays
        scalars = _learn(guide, transitions, result, start, on_step) if first + count < settings.spp else {}
        result.seconds = time.perf_counter() - start
        result.losses += scalars.pop("losses", [scalars["loss"]] if "loss" in scalars else [])
        result.curve.append({"samples": film.samples, "seconds": result.seconds} | scalars)
        if on_pass:
            on_pass(result)
            start = time.perf_counter() - result.seconds
        if settings.noise and film.samples >= LEAST_SAMPLES:
            pixels = _noisy(film, settings.noise)
        if not len(pixels) or 0 < settings.seconds <= result.seconds:
            break
    result.finished = True
    return result


def _learn(
    guide: Guide, transitions: Transitions, result: Result, start: float, on_step: Callable[[Result], None] | None
) -> dict[str, Any]:
    """Have the guide learn from a pass; returns what it says of it. Keeps the times of the result, which began at `start`, up to date."""
    began = told = time.perf_counter()
    before = result.learn_seconds

    def step(steps: int) -> None:
        nonlocal told
        now = time.perf_counter()
        result.steps, result.seconds, result.learn_seconds = steps, now - start, before + now - began
        if on_step and now - told >= TOLD_EVERY:
            told = now
            on_step(result)

    scalars = guide.learn(transitions, step)
    result.learn_seconds = before + time.perf_counter() - began
    return scalars


def _rounds(settings: Render, pixels: int, learning: bool) -> Iterator[tuple[int, int]]:
    """(first sample, samples) of each pass: one sample each to learn from, or as many as there are already, up to a power of two.

    So every power of two ends a pass, where stratified samples are complete, and error curves want a point.
    """
    most = 1 if learning else max(1, PATHS_PER_PASS // pixels)
    if settings.noise or settings.seconds:
        most = min(most, CHECKED_EVERY)
    most = 1 << (most.bit_length() - 1)
    first = 0
    while first < settings.spp:
        count = min(max(first, 1), most, settings.spp - first)
        yield first, count
        first += count


def _noisy(film: Film, threshold: float) -> np.ndarray:
    """The pixels that are noisier than the threshold, and their neighbours."""
    noisy = np.pad(film.noise() > threshold, 1)
    noisy = noisy[:-2] | noisy[1:-1] | noisy[2:]
    return np.flatnonzero(noisy[:, :-2] | noisy[:, 1:-1] | noisy[:, 2:])


def warm_up(guide: GuideSettings, machine: Machine) -> None:
    """Compile or load every kernel that a render with such a guide needs, and import what it needs: nothing timed should include it."""
    if isinstance(guide, QTable):
        guide = QTable(rows=1, columns=2)
    elif isinstance(guide, DQN):
        guide = DQN(layers=1, width=1, rows=1, columns=2, learning_starts=1, batch=2, first_steps=1, steps=1)
    render(_tiny_scene(), Render(spp=3, nee=True, max_bounces=2, guide=guide), machine)


def _tiny_scene() -> SceneData:
    """A lit triangle in front of a camera of 4 x 4 pixels."""
    return SceneData(
        name="tiny",
        vertices=np.array([(-9, -9, -1), (9, -9, -1), (0, 9, -1)], np.float32),
        triangles=np.array([(0, 1, 2)], np.int32),
        normals=np.array([[(0, 0, 1)] * 3], np.float32),
        material=np.zeros(1, np.int32),
        object=np.zeros(1, np.int32),
        shaders=(Shader("lit", (), (Closure("diffuse", 0.5), Closure("emission", 1.0))),),
        camera=Camera(IDENTITY, (-0.1, 0.1, -0.1, 0.1), 4, 4),
        world=Shader("", (Instruction("position"),), (Closure("emission", 1.0, {"color": Node(0)}),)),  # one that has to be mapped
        bounces=Bounces(2, 2, 2, 2),
    )
