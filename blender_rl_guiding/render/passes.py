"""Passes over the image, traced by threads."""

import os
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ..guiding.base import Transitions, empty_transitions
from ..guiding.directions import Directions
from ..sampling import F
from ..scene.data import SceneData
from ..settings import Machine, Render
from .film import Film
from .path_tracer import MOST_LEARNT, PASS_COLUMNS, trace_paths
from .stage import Scratch, build_stage, limits, scratch, wants_passes

PATHS_AT_ONCE = 1 << 20  # whose radiance is held before it is added to the film, so that memory does not grow with samples


class PassTracer:
    """Traces samples of pixels on to a film; every thread takes the next few thousand paths until there are none left."""

    def __init__(self, scene: SceneData, settings: Render, machine: Machine, learning: bool) -> None:
        """`learning`: whether any pass will be asked for transitions."""
        self._stage, self._geometry = build_stage(scene)
        self._limits = limits(scene, settings, self._stage)
        self._seed, self._passes, self._batch = settings.seed, wants_passes(scene, settings), machine.batch
        room = machine.batch * min(self._limits.total + 1, MOST_LEARNT) if learning else 1
        self._threads = [scratch(room) for _ in range(machine.threads or os.cpu_count() or 1)]
        self._vertices_per_path = float(self._limits.total + 1)
        self.rays = 0  # cast so far, closest-hit and shadow rays

    def trace(self, directions: Directions, film: Film, pixels: np.ndarray, first: int, count: int, wanted: int) -> Transitions:
        """Add samples first .. first + count - 1 of `pixels`, (n,) int64, to the film.

        Returns about `wanted` transitions, in an order of their own.
        """
        share = F(min(1.0, wanted / (count * len(pixels) * self._vertices_per_path)))
        recorded, vertices = [], 0
        for sample, several, part in _portions(pixels, first, count):
            radiance = np.zeros((several * len(part), 3), np.float32)
            passes = np.zeros((len(radiance) if self._passes else 0, PASS_COLUMNS), np.float32)
            transitions, seen = self._portion(directions, share, part, sample, radiance, passes)
            film.add(part, radiance, passes)
            recorded.append(transitions)
            vertices += seen
        self._vertices_per_path = max(1, vertices) / (count * len(pixels))  # there is none where every path misses, or at no bounce
        return Transitions(*(np.concatenate(arrays) for arrays in zip(*recorded, strict=True)))

    def _portion(self, directions, share, pixels, sample, radiance, passes) -> tuple[Transitions, int]:
        """Trace the paths that `radiance` has room for."""
        starts = iter(range(0, len(radiance), self._batch))
        stop = threading.Event()

        def work(memory: Scratch) -> tuple[list[Transitions], int, int]:
            recorded, rays, vertices = [], 0, 0
            while (start := next(starts, None)) is not None and not stop.is_set():
                size = min(self._batch, len(radiance) - start)
                trace_paths(
                    self._stage, directions, self._limits, share, self._seed, pixels, sample, start, size, memory, radiance, passes
                )
                rays, vertices, found = rays + int(memory.counts[0]), vertices + int(memory.counts[1]), int(memory.counts[2])
                if found:
                    recorded.append(Transitions(*(array[:found].copy() for array in memory.transitions)))
            return recorded, rays, vertices

        pool = ThreadPoolExecutor(len(self._threads))
        try:
            parts = [future.result() for future in [pool.submit(work, memory) for memory in self._threads]]
        finally:
            stop.set()  # an interrupt does not wait for the paths under way
            pool.shutdown(wait=False, cancel_futures=True)
        self.rays += sum(part[1] for part in parts)
        return _sorted([t for part in parts for t in part[0]]), sum(part[2] for part in parts)


def _portions(pixels: np.ndarray, first: int, count: int):
    """(first sample, samples, pixels) that together are all samples of all pixels, none with more than PATHS_AT_ONCE paths."""
    for start in range(0, len(pixels), PATHS_AT_ONCE):
        part = pixels[start : start + PATHS_AT_ONCE]
        several = max(1, PATHS_AT_ONCE // len(part))
        for sample in range(first, first + count, several):
            yield sample, min(several, first + count - sample), part


def _sorted(parts: list[Transitions]) -> Transitions:
    if not parts:
        return empty_transitions(0)
    order = np.argsort(np.concatenate([part.order for part in parts]))
    return Transitions(*(np.concatenate(arrays)[order] for arrays in zip(*parts, strict=True)))
