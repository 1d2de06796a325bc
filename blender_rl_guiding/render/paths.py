"""The state of a wavefront: paths, shadow rays and their buffers, allocated once a thread."""

from typing import NamedTuple

import numpy as np

from ..guiding.base import Transitions, empty_transitions


class Paths(NamedTuple):
    """Paths in flight, in structure of arrays; survivors are written densely, so no compaction is needed."""

    origin: np.ndarray  # (n, 3) float32, where the ray starts: off the surface it leaves
    direction: np.ndarray  # (n, 3) float32, unit
    throughput: np.ndarray  # (n, 3) float32, beta
    normal: np.ndarray  # (n, 3) float32, shading normal at the origin
    pdf: np.ndarray  # (n,) float32, density with which the direction was drawn
    key: np.ndarray  # (n,) uint64, random stream
    path: np.ndarray  # (n,) int64, the path's place in the pass


class ShadowRays(NamedTuple):
    """Next-event estimates that count if nothing stands in between."""

    origin: np.ndarray  # (n, 3) float32
    direction: np.ndarray  # (n, 3) float32, unit
    distance: np.ndarray  # (n,) float32
    contribution: np.ndarray  # (n, 3) float32, radiance at the camera
    reward: np.ndarray  # (n,) float32, luminance that leaves the vertex towards the one before
    path: np.ndarray  # (n,) int64, the path's place in the pass
    transition: np.ndarray  # (n,) int32, the transition that the reward belongs to, or -1


class Workspace(NamedTuple):
    """All that one thread needs for wavefronts of up to n paths."""

    paths: tuple[Paths, Paths]  # read from one, written to the other, in turn
    shadow: ShadowRays
    transitions: Transitions
    counts: np.ndarray  # (3,) int64: paths that go on, shadow rays, transitions


def workspace(size: int, learning: bool) -> Workspace:
    """Buffers for `size` paths; room for transitions only if a guide learns."""
    scalar, vector = (lambda: np.zeros(size, np.float32)), (lambda: np.zeros((size, 3), np.float32))

    def paths() -> Paths:
        return Paths(vector(), vector(), vector(), vector(), scalar(), np.zeros(size, np.uint64), np.zeros(size, np.int64))

    shadow = ShadowRays(vector(), vector(), scalar(), vector(), scalar(), np.zeros(size, np.int64), np.zeros(size, np.int32))
    return Workspace((paths(), paths()), shadow, empty_transitions(size if learning else 1), np.zeros(3, np.int64))
