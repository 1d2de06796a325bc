"""The one entry: passes over the image, each learnt from before the next."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..guiding import make_guide
from ..scene.data import Camera, Material, SceneData
from ..settings import DQN, Machine, Render
from ..settings import Guide as GuideSettings
from .film import Film
from .passes import PassTracer

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
    guide = make_guide(settings.guide, scene, settings.seed)
    tracer = PassTracer(scene, settings, machine, learning=guide.wanted() > 0)
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
