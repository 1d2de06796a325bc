"""Passes over the image, traced by threads."""

import itertools
import os
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ..guiding.base import Transitions, empty_transitions
from ..guiding.directions import Directions
from ..sampling import F
from ..scene.camera import camera_rays, pinhole
from ..scene.data import SceneData
from ..scene.geometry import RayQueries, surface
from ..scene.lights import lights
from ..settings import Machine, Render
from .path_tracer import add_direct, bounce
from .paths import Workspace, workspace


class PassTracer:
    """Traces passes over the image; every thread runs small wavefronts of its own in buffers that stay in its cache."""

    def __init__(self, scene: SceneData, settings: Render, machine: Machine, learning: bool) -> None:
        """`learning`: whether any pass will be asked for transitions."""
        max_bounces = settings.max_bounces if settings.max_bounces >= 0 else scene.max_bounces
        world = tuple(F(c) for c in scene.world)
        self._scene = (surface(scene), lights(scene), world)
        self._camera = pinhole(scene)
        self._pixels = scene.camera.width * scene.camera.height
        self._max_bounces = max_bounces
        self._nee = settings.nee and len(self._scene[1].triangle) > 0
        self._seed = settings.seed
        self._batch = min(machine.batch, settings.spp * self._pixels)
        self._workspaces = [workspace(self._batch, learning) for _ in range(machine.threads or os.cpu_count() or 1)]
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

        def work(buffers: Workspace) -> tuple[list[Transitions], int, int]:
            recorded: list[Transitions] = []
            rays = vertices = 0
            while (start := next(batches, None)) is not None and not stop.is_set():
                size = min(self._batch, total - start)
                camera_rays(self._camera, self._seed, self._pixels, start, first, size, buffers.paths[0])
                r, v = self._wavefront(directions, share, size, buffers, radiance, recorded)
                rays, vertices = rays + r, vertices + v
            return recorded, rays, vertices

        pool = ThreadPoolExecutor(len(self._workspaces))
        try:
            parts = [future.result() for future in [pool.submit(work, buffers) for buffers in self._workspaces]]
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
