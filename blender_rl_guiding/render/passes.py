"""Passes over the image, traced by threads."""

import os
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ..guiding.base import Transitions, empty_transitions
from ..guiding.directions import Directions
from ..kernels.sampling import F
from ..scene.data import SceneData
from ..settings import Machine, Render
from .film import Film
from .path_tracer import MOST_LEARNT, trace_pixels
from .stage import RAYS, RECORDABLE, RECORDED, Scratch, build_stage, limits, scratch


class PassTracer:
    """Adds samples of pixels to a film. Each thread takes the next few pixels until none are left.

    One thread adds all samples of a pixel in their order, so the bits do not depend on the number of threads.
    """

    def __init__(self, scene: SceneData, settings: Render, machine: Machine, learning: bool) -> None:
        """learning: whether any call of `trace` will want transitions. InputError as in `build_stage`."""
        self._stage, self._geometry = build_stage(scene)
        self._limits = limits(scene, settings, self._stage)
        self._seed, self._batch = settings.seed, machine.batch
        room = machine.batch * min(self._limits.total + 1, MOST_LEARNT) if learning else 1
        self._threads = [scratch(room) for _ in range(machine.threads or os.cpu_count() or 1)]
        self.vertices_per_path = float(self._limits.total + 1)  # of the last pass; `trace` computes the recorded share from it
        self.rays = 0  # cast so far, closest-hit and shadow rays

    def trace(self, directions: Directions, film: Film, pixels: np.ndarray, first: int, samples: int, wanted: int) -> Transitions:
        """Add samples first .. first + samples - 1 of `pixels`, (n,) int64, to the film.

        Returns about `wanted` transitions. FloatingPointError if radiance is not finite: this is a fault of the tracer, and an image must
        not hide it.
        """
        share = F(min(1.0, wanted / (samples * len(pixels) * self.vertices_per_path)))
        # Each call costs 0.3 ms in which other threads wait, so calls are large. Yet there are 4 per thread, to balance the load.
        step = max(1, min(self._batch // samples, len(pixels) // (4 * len(self._threads))))
        starts = iter(range(0, len(pixels), step))
        stop = threading.Event()

        def work(memory: Scratch) -> tuple[dict[int, Transitions], int, int]:
            recorded, rays, vertices = {}, 0, 0
            while (start := next(starts, None)) is not None and not stop.is_set():
                end = min(start + step, len(pixels))
                common = self._stage, directions, self._limits, share, self._seed, pixels
                bad = trace_pixels(*common, start, end, first, samples, memory, film.sums)
                if bad >= 0:
                    y, x = divmod(bad, film.shape[1])
                    raise FloatingPointError(f"pixel ({x}, {y}) received radiance that is not a finite number")
                counts = memory.counts
                rays, vertices, found = rays + int(counts[RAYS]), vertices + int(counts[RECORDABLE]), int(counts[RECORDED])
                if found:
                    recorded[start] = Transitions(*(array[:found].copy() for array in memory.transitions))
            return recorded, rays, vertices

        with ThreadPoolExecutor(len(self._threads)) as pool:
            try:
                parts = [future.result() for future in [pool.submit(work, memory) for memory in self._threads]]
            finally:
                stop.set()  # after an interrupt each thread ends after the few thousand paths of its call
        self.rays += sum(part[1] for part in parts)
        self.vertices_per_path = max(1, sum(part[2] for part in parts)) / (samples * len(pixels))  # 0 if all paths miss
        recorded = {start: transitions for part in parts for start, transitions in part[0].items()}
        if not recorded:
            return empty_transitions(0)
        # In the order of pixels, whichever thread was faster.
        return Transitions(*map(np.concatenate, zip(*(recorded[start] for start in sorted(recorded)), strict=True)))
