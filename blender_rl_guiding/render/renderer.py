"""The one entry: passes over the image, each traced by threads with a wavefront of their own, then learnt from."""

import itertools
import os
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from ..guiding import make_guide
from ..guiding.base import Transitions, empty_transitions
from ..guiding.directions import Directions
from ..sampling import F
from ..scene.camera import camera_rays, pinhole
from ..scene.data import Camera, Material, SceneData
from ..scene.geometry import RayQueries, surface
from ..scene.lights import lights
from ..settings import DQN, Machine, Render
from ..settings import Guide as GuideSettings
from .film import Film
from .path_tracer import add_direct, bounce
from .paths import Workspace, workspace

PATHS_PER_PASS = 1 << 20  # about; bounds the memory of a pass, and how long a pass of a guide that does not learn takes


@dataclass
class Result:
    """What a render has to show so far; `film` holds the samples of whole passes only."""

    film: Film
    seconds: float = 0.0  # wall time of tracing and learning
    learn_seconds: float = 0.0
    rays: int = 0  # closest-hit and shadow rays
    curve: list[dict[str, float]] = field(default_factory=list)  # one entry a pass: samples, seconds, loss, ...

    @property
    def image(self) -> np.ndarray:
        """(height, width, 3) float32, linear, top row first."""
        return self.film.mean()


def render(
    scene: SceneData,
    settings: Render,
    machine: Machine = Machine(),  # noqa: B008  # frozen
    on_pass: Callable[[Result], None] | None = None,
) -> Result:
    """Render a scene. Scene, settings and the machine's floating-point unit decide every bit of the image; `machine` does not.

    `on_pass` is called after every pass with the state so far; what it raises ends the render at once.
    """
    camera = scene.camera
    tracer = PassTracer(scene, settings, machine)
    guide = make_guide(settings.guide, scene, settings.seed)
    result = Result(Film(camera.width, camera.height))
    pixels = camera.width * camera.height
    per_pass = 1 if guide.wanted() else max(1, min(PATHS_PER_PASS // pixels, settings.spp))
    start = time.perf_counter()
    for first in range(0, settings.spp, per_pass):
        count = min(per_pass, settings.spp - first)
        radiance, transitions, rays = tracer.trace(guide.directions(), first, count, guide.wanted())
        result.film.add(radiance)
        result.rays += rays
        learning = time.perf_counter()
        scalars = guide.learn(transitions) if first + count < settings.spp else {}
        result.learn_seconds += time.perf_counter() - learning
        result.seconds = time.perf_counter() - start
        result.curve.append({"samples": result.film.samples, "seconds": result.seconds} | scalars)
        if on_pass:
            on_pass(result)
    return result


class PassTracer:
    """Traces passes over the image; every thread runs small wavefronts of its own in buffers that stay in its cache."""

    def __init__(self, scene: SceneData, settings: Render, machine: Machine) -> None:
        max_bounces = settings.max_bounces if settings.max_bounces >= 0 else scene.max_bounces
        world = tuple(F(c) for c in scene.world)
        self._scene = (surface(scene), lights(scene), world)
        self._camera = pinhole(scene)
        self._pixels = scene.camera.width * scene.camera.height
        self._max_bounces = max_bounces
        self._nee = settings.nee and len(self._scene[1].triangle) > 0
        self._seed = settings.seed
        self._batch = machine.batch
        self._threads = machine.threads or os.cpu_count() or 1
        self._queries = RayQueries(scene)
        self._vertices_per_path = float(max_bounces + 1)

    def trace(self, directions: Directions, first: int, count: int, wanted: int) -> tuple[np.ndarray, Transitions, int]:
        """Trace samples first .. first + count - 1 of every pixel.

        Returns the radiance of each path (count * pixels, 3), about `wanted` transitions in an order of their own, and the rays cast.
        """
        total = count * self._pixels
        radiance = np.zeros((total, 3), np.float32)
        share = F(min(1.0, wanted / (total * self._vertices_per_path)))
        batches = iter(range(0, total, self._batch))
        stop = threading.Event()

        def work() -> tuple[list[Transitions], int, int]:
            buffers = workspace(min(self._batch, total), learning=wanted > 0)
            recorded: list[Transitions] = []
            rays = vertices = 0
            while (start := next(batches, None)) is not None and not stop.is_set():
                size = min(self._batch, total - start)
                camera_rays(self._camera, self._seed, self._pixels, start, first, size, buffers.paths[0])
                r, v = self._wavefront(directions, share, size, buffers, radiance, recorded)
                rays, vertices = rays + r, vertices + v
            return recorded, rays, vertices

        pool = ThreadPoolExecutor(self._threads)
        try:
            parts = [future.result() for future in [pool.submit(work) for _ in range(self._threads)]]
        finally:
            stop.set()  # an interrupt does not wait for the wavefronts under way
            pool.shutdown(wait=False, cancel_futures=True)
        self._vertices_per_path = max(1, sum(p[2] for p in parts)) / total  # there is none where every path misses, or at no bounce
        return radiance, _sorted([t for p in parts for t in p[0]]), sum(p[1] for p in parts)

    def _wavefront(self, directions, share, count, buffers: Workspace, radiance, recorded) -> tuple[int, int]:
        """Follow `count` paths to their ends; returns rays cast and vertices that could have become transitions."""
        settings = (self._max_bounces, self._nee, share)
        shadow, transitions, counts = buffers.shadow, buffers.transitions, buffers.counts
        rays = vertices = 0
        for depth, (now, after) in zip(range(self._max_bounces + 1), itertools.cycle([(0, 1), (1, 0)])):
            paths, following = buffers.paths[now], buffers.paths[after]
            hits = self._queries.closest(paths.origin[:count], paths.direction[:count])
            rays, vertices = rays + count, vertices + count * (depth > 0)
            bounce(self._scene, directions, settings, depth, count, paths, hits, following, shadow, transitions, counts, radiance)
            count, shadows, transitions_written = (int(c) for c in counts)
            if shadows:
                visible = self._queries.visible(shadow.origin[:shadows], shadow.direction[:shadows], shadow.distance[:shadows])
                add_direct(shadows, visible, shadow, transitions, radiance)
                rays += shadows
            if transitions_written:
                recorded.append(Transitions(*(array[:transitions_written].copy() for array in transitions)))
            if not count:
                break
        return rays, vertices


def _sorted(parts: list[Transitions]) -> Transitions:
    if not parts:
        return empty_transitions(0)
    order = np.argsort(np.concatenate([part.order for part in parts]))
    return Transitions(*(np.concatenate(arrays)[order] for arrays in zip(*parts, strict=True)))


def warm_up(guide: GuideSettings, machine: Machine) -> None:
    """Compile or load every kernel that a render with such a guide needs, and import what it needs: nothing timed should include it."""
    if isinstance(guide, DQN):
        guide = DQN(layers=1, width=1, rows=1, columns=2, learning_starts=1, batch=2, first_steps=1, steps=1)
    render(_tiny_scene(), Render(spp=3, nee=True, max_bounces=2, guide=guide), machine)


def _tiny_scene() -> SceneData:
    """A lit triangle in front of a camera of 4 x 4 pixels."""
    camera = Camera(tuple(map(tuple, np.eye(4).tolist())), 0.1, 0.1, 4, 4)
    return SceneData(
        name="tiny",
        vertices=np.array([(-9, -9, -1), (9, -9, -1), (0, 9, -1)], np.float32),
        triangles=np.array([(0, 1, 2)], np.int32),
        normals=np.array([[(0, 0, 1)] * 3], np.float32),
        material=np.zeros(1, np.int32),
        materials=(Material("lit", (0.5, 0.5, 0.5), (1.0, 1.0, 1.0)),),
        camera=camera,
        world=(1.0, 1.0, 1.0),
        max_bounces=2,
    )
