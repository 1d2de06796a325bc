"""A tree of boxes around lamps: a ray is tested against the few lamps whose boxes it crosses, not against thousands."""

from typing import NamedTuple

import numpy as np

from ..kernels import part
from ..kernels.sampling import F
from .lamps import AREA, AXIS_X, AXIS_Y, HEIGHT, HITTABLE, KIND, POSITION, RADIUS, SUN, WIDTH

_EVERYWHERE = 1e30
_LEAST = F(1e-20)  # replaces smaller components of a direction: a ray along an axis would divide by zero


class LampTree(NamedTuple):
    """N boxes. The boxes inside box i follow it, up to skip[i] - 1. The next test after a miss of box i is box skip[i]."""

    low: np.ndarray  # (N, 3) float32
    high: np.ndarray  # (N, 3) float32
    skip: np.ndarray  # (N,) int32
    lamp: np.ndarray  # (N,) int32, the lamp in a leaf; -1 for boxes that contain boxes


def lamp_tree(lamps: np.ndarray) -> LampTree:
    """The tree of the lamps that rays can hit. lamps: a `lamp_table`, (K, COLUMNS)."""
    hittable = np.flatnonzero(lamps[:, HITTABLE])
    low, high = _bounds(lamps[hittable])
    boxes: list[tuple[np.ndarray, np.ndarray]] = []
    skip: list[int] = []
    lamp: list[int] = []

    def add(members: np.ndarray) -> None:
        here = len(boxes)
        boxes.append((low[members].min(axis=0), high[members].max(axis=0)))
        skip.append(0)
        lamp.append(int(hittable[members[0]]) if len(members) == 1 else -1)
        if len(members) > 1:
            centre = low[members] + high[members]
            order = np.argsort(centre[:, np.ptp(centre, axis=0).argmax()])
            add(members[order[: len(members) // 2]])
            add(members[order[len(members) // 2 :]])
        skip[here] = len(boxes)

    if len(hittable):
        add(np.arange(len(hittable)))
    both = np.array(boxes, np.float32).reshape(-1, 2, 3)
    return LampTree(np.ascontiguousarray(both[:, 0]), np.ascontiguousarray(both[:, 1]), np.array(skip, np.int32), np.array(lamp, np.int32))


def _bounds(lamps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3) lowest and highest corner of each lamp's box, enlarged for rounding. A sun's box contains every ray."""
    area = lamps[:, [KIND]] == AREA
    across = np.abs(lamps[:, AXIS_X : AXIS_X + 3]) * lamps[:, [WIDTH]] + np.abs(lamps[:, AXIS_Y : AXIS_Y + 3]) * lamps[:, [HEIGHT]]
    half = np.where(area, across / 2, lamps[:, [RADIUS]])
    half = half + 1e-3 * half.max(axis=1, keepdims=True, initial=0)
    half[lamps[:, KIND] == SUN] = _EVERYWHERE
    centre = lamps[:, POSITION : POSITION + 3]
    half = half + 1e-5 * np.abs(centre)
    return centre - half, centre + half


@part
def inverse(direction):
    """1 / direction, by components; `crosses` reads this."""
    return _over(direction[0]), _over(direction[1]), _over(direction[2])


@part
def _over(x):
    return F(1) / (x if abs(x) > _LEAST else _LEAST)


@part
def crosses(tree, i, origin, inverse, far):
    """Whether a ray passes through box i before `far`."""
    near = F(0)
    for axis in range(3):
        a = (tree.low[i, axis] - origin[axis]) * inverse[axis]
        b = (tree.high[i, axis] - origin[axis]) * inverse[axis]
        near, far = max(near, min(a, b)), min(far, max(a, b))
    return near <= far
