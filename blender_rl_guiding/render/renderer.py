"""The one entry: passes over the image, each learnt from before the next."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..guiding import make_guide
from ..guiding.base import Guide, Transitions
from ..scene.data import SceneData
from ..scene.description import IDENTITY, Bounces, Camera, Closure, Instruction, Node, Shader
from ..settings import DQN, Machine, QTable, Render
from ..settings import Guide as GuideSettings
from .checkpoint import Checkpoint
from .film import Film
from .needs import require
from .noise import needed
from .passes import PassTracer
from .result import Result
from .stage import wants_passes

PATHS_PER_PASS = 1 << 20  # at most, of a guide that does not learn
CHECKED_EVERY = 4  # samples between two looks at the clock or the noise, at most
TOLD_EVERY = 0.1  # seconds between two calls of `on_step`, at least


def render(
    scene: SceneData,
    settings: Render,
    machine: Machine = Machine(),  # noqa: B008  # frozen
    on_pass: Callable[[Result], None] | None = None,
    on_step: Callable[[Result], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> Result:
    """Render a scene. Scene, settings and the machine's floating-point unit decide every bit of the image; `machine` does not.

    `on_pass` is called after every pass with the state so far, and may add to the curve's last entry; its time does not count. What it
    raises ends the render at once. `on_step` is called now and then while a guide trains, which may take longer than all passes.
    From a checkpoint of this render it goes on to the same bits; `on_pass` is first told once more of the last pass before.
    """
    require(scene, settings, machine)

    def begun() -> Result:
        film = Film(scene.camera.width, scene.camera.height, scene.film.exposure, wants_passes(scene, settings))
        return Result(film, make_guide(settings.guide, scene, settings.seed))

    result, pixels = begun(), np.arange(scene.camera.width * scene.camera.height)
    learning = result.guide.wanted() > 0
    tracer = PassTracer(scene, settings, machine, learning)
    if checkpoint and (before := checkpoint.taken_up(scene, settings, machine, begun)):
        result = before
        tracer.rays, tracer.vertices_per_path = result.rays, result.vertices_per_path
        pixels = _look_ahead(result, settings)
        if on_pass:
            on_pass(result)
    guide, film = result.guide, result.film
    for first, count in _rounds(settings, film.counts.size, learning, result.taken):
        start = time.perf_counter() - result.seconds
        if not len(pixels) or 0 < settings.seconds <= result.seconds:
            break
        if checkpoint and first:
            start += checkpoint.offer(result)
        wanted = guide.wanted() if learning else 0  # the tracer has no room for any
        transitions = tracer.trace(guide.directions(), film, pixels, first, count, wanted)
        result.taken = first + count
        pixels = _look_ahead(result, settings)
        result.rays, result.vertices_per_path = tracer.rays, tracer.vertices_per_path
        scalars = _learn(guide, transitions, result, start, on_step) if first + count < settings.spp else {}
        result.seconds = time.perf_counter() - start
        result.losses += scalars.pop("losses", [scalars["loss"]] if "loss" in scalars else [])
        result.curve.append({"samples": result.taken, "seconds": result.seconds} | scalars)
        if on_pass:
            on_pass(result)
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


def _rounds(settings: Render, pixels: int, learning: bool, first: int) -> Iterator[tuple[int, int]]:
    """(first sample, samples) of each pass after `first` samples: one each to learn from, or as many as there are, up to a power of two.

    So every power of two ends a pass, where stratified samples are complete, and error curves want a point.
    """
    most = 1 if learning else max(1, PATHS_PER_PASS // pixels)
    if settings.noise or settings.seconds:
        most = min(most, CHECKED_EVERY)
    most = 1 << (most.bit_length() - 1)
    while first < settings.spp:
        count = min(max(first, 1), most, settings.spp - first)
        yield first, count
        first += count


def _look_ahead(result: Result, settings: Render) -> np.ndarray:
    """The pixels of the next pass, (n,) int64. Notes on the result how many samples are to come."""
    more = needed(result.film, settings, result.taken)
    result.ahead, result.rounds = float(more.sum() / result.film.counts.sum()), int(more.max())
    return np.flatnonzero(more)


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
