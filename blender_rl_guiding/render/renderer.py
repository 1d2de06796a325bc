"""`render`, the entry of the renderer: passes over the image. The guide learns from each pass before the next."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..guide_settings import GuideSettings
from ..guiding import make_guide
from ..guiding.base import Guide, Transitions
from ..scene.data import SceneData
from ..scene.description import IDENTITY, Bounces, Camera, Closure, Instruction, Node, Shader
from ..settings import Machine, Render
from .checkpoint import Checkpoint
from .film import Film
from .needs import require
from .noise import needed
from .passes import PassTracer
from .result import Result
from .stage import wants_passes

PATHS_PER_PASS = 1 << 20  # most paths in a pass if the guide does not learn
CHECKED_EVERY = 4  # most samples between two checks of the time and noise limits
TOLD_EVERY = 0.1  # least seconds between two calls of `on_step`


def render(
    scene: SceneData,
    settings: Render,
    machine: Machine = Machine(),  # noqa: B008  # frozen
    on_pass: Callable[[Result], None] | None = None,
    on_step: Callable[[Result], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> Result:
    """Render a scene. Scene, settings and the processor's arithmetic decide every bit of the image; `machine` does not.

    on_pass: called with the state after each pass; it may add to the curve's last entry. Its time does not count. Its exceptions end the
    render at once. on_step: called now and then while a guide trains, because training may take longer than all passes. checkpoint:
    the render goes on from it, to the same bits. `on_pass` is then called first for the last pass in the checkpoint.

    InputError if the scene cannot be rendered or does not fit into memory. FloatingPointError as in `PassTracer.trace`.
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
        wanted = guide.wanted() if learning else 0  # a tracer without learning has no room for transitions
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
    """Let the guide learn from a pass. Returns the guide's numbers about the pass.

    Updates the times in `result` while the guide learns. start: value of perf_counter() at the beginning of the render.
    """
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
    """(first sample, samples) of each pass after `first` samples. With learning a pass has one sample.

    Without learning each pass doubles the samples, up to a limit that is a power of two. A pass ends at every power
    of two: stratified samples are complete there, and error curves have a point.
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
    """The pixels of the next pass, (n,) int64. Writes the number of samples to come into `result`."""
    more = needed(result.film, settings, result.taken)
    result.ahead, result.rounds = float(more.sum() / result.film.counts.sum()), int(more.max())
    return np.flatnonzero(more)


def warm_up(guide: GuideSettings, machine: Machine) -> None:
    """Compile or load all kernels, and import all libraries, of a render with such a guide. Measured times then do not include this."""
    least: Any = guide.least()  # one of the kinds in the union
    render(_tiny_scene(), Render(spp=3, nee=True, max_bounces=2, guide=least), machine)


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
        world=Shader("", (Instruction("position"),), (Closure("emission", 1.0, {"color": Node(0)}),)),  # varies: gets a `WorldMap`
        bounces=Bounces(2, 2, 2, 2),
    )
