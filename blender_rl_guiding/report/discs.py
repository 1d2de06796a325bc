"""Hemispheres as discs, seen from outside along the normal. Equal areas are equal solid angles, so all patches have the same area.

The centre is the normal, the rim is the horizon. The tangent points right, the bitangent up. A direction at angle theta has the radius
sqrt(1 - cos(theta)) (Lambert's azimuthal projection).
"""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure

from .charts import Axis
from .pictures import COLOURS

DARKEST = 1e-30  # radiance; smaller values count as 0
DECADES = 4.0  # maximal decades of a scale; darker patches are black
SMOOTH = 3  # sample points per pixel, along each side
_LABELS = 5  # maximal number of ticks below a bar of colours
PIXELS = 480  # of a disc, along each side
_GAP, _TITLE, _BAR, _NOTE = 0.12, 0.4, 0.52, 0.26  # inches: between discs, above them, below them, at the bottom
_LETTER = 0.05  # inches, of the line at the bottom, about


def scale(hemispheres: Iterable[np.ndarray]) -> Axis:
    """A common logarithmic scale: from the 1 % quantile of the patches, but at most `DECADES` below the top, to the brightest patch."""
    values = np.concatenate([np.ravel(h) for h in hemispheres])
    positive = values[values > DARKEST]
    if not len(positive):
        return Axis(True, -1.0, 0.0)
    high = math.log10(positive.max())
    return Axis(True, min(max(math.log10(np.percentile(positive, 1)), high - DECADES), high - 1.0), high)


def labels(axis: Axis) -> list[float]:
    """The ticks of the axis; some are left out if there is too little room."""
    ticks = axis.ticks()
    return ticks[:: math.ceil(len(ticks) / _LABELS)]


def picture(values: np.ndarray, axis: Axis, size: int) -> np.ndarray:
    """A hemisphere (rows, columns), row 0 at the horizon, in false colours: (size, size, 4) uint8, sRGB codes and coverage."""
    rows, columns = values.shape
    place = (np.arange(SMOOTH * size) + 0.5) / (SMOOTH * size) * 2 - 1
    x, y = place[None, :], -place[:, None]
    squared = x * x + y * y
    row = np.clip(((1 - squared) * rows).astype(int), 0, rows - 1)
    column = np.minimum((np.arctan2(y, x) / (2 * np.pi) % 1 * columns).astype(int), columns - 1)
    rgba = np.dstack([_colours(values, axis)[row, column], 255 * (squared <= 1)])
    return np.rint(rgba.reshape(size, SMOOTH, size, SMOOTH, 4).mean(axis=(1, 3))).astype(np.uint8)


def _colours(values: np.ndarray, axis: Axis) -> np.ndarray:
    along = (np.log10(np.maximum(values, DARKEST)) - axis.low) / (axis.high - axis.low)
    return COLOURS[np.rint(along.clip(0, 1) * (len(COLOURS) - 1)).astype(int)]


def averaged(fine: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """The means of a hemisphere over (rows, columns) other patches. A fine patch counts in each coarse patch by its share of the area."""
    return _shares(rows, fine.shape[0]) @ fine @ _shares(columns, fine.shape[1]).T


def _shares(coarse: int, fine: int) -> np.ndarray:
    """(coarse, fine): the share of coarse interval i that fine interval j covers, for equal intervals of 0..1."""
    ends = np.arange(coarse)[:, None] / coarse, np.arange(fine)[None, :] / fine
    overlap = np.minimum(ends[0] + 1 / coarse, ends[1] + 1 / fine) - np.maximum(*ends)
    return overlap.clip(0) * coarse


def relative_error(q: np.ndarray, truth: np.ndarray) -> float:
    """mean |Q - truth| / mean truth, over the patches of Q. If the truth is 0, the error is 0 or infinite."""
    expected = averaged(truth, *q.shape)
    off, mean = float(np.abs(q - expected).mean()), float(expected.mean())
    return off / mean if mean else (math.inf if off else 0.0)


def verdict(q: np.ndarray, truth: np.ndarray, nee: bool) -> str:
    """The error of Q as text. With next-event estimation (NEE) there is no error, because Q then leaves out the lights."""
    return "what NEE leaves" if nee else f"off by {100 * relative_error(q, truth):.0f}\N{NO-BREAK SPACE}%"


def direction(vector: Sequence[float]) -> str:
    """A unit vector of the world by its axis, "+x", or as numbers."""
    nearest = int(np.argmax(np.abs(vector)))
    if abs(vector[nearest]) > 0.9999:
        return f"{'+' if vector[nearest] > 0 else '-'}{'xyz'[nearest]}"
    return f"({', '.join(f'{component:.2f}' for component in vector)})"


def caption(scene: str, pixel: Sequence[int], right: Sequence[float], up: Sequence[float]) -> str:
    """A line with the scene and pixel of a hemisphere, and with its directions."""
    return f"{scene}, pixel ({pixel[0]}, {pixel[1]}); seen along the normal, right is {direction(right)}, up is {direction(up)}"


# --- figures ----------------------------------------------------------------------------------------------------------


class Disc(NamedTuple):
    """A hemisphere (rows, columns), and its title of one or two lines."""

    title: str
    values: np.ndarray


class Group(NamedTuple):
    """Discs of one scale."""

    discs: Sequence[Disc]
    axis: Axis
    label: str


def figure(groups: Sequence[Group], note: str, side: float) -> Figure:
    """All groups beside each other, with discs `side` inches wide, and a line below them."""
    cell, height = side + _GAP, _TITLE + side + _BAR + _NOTE
    row = cell * sum(len(group.discs) for group in groups)
    width = max(row, _LETTER * len(note))
    drawn, left = Figure((width, height)), (width - row + _GAP) / 2
    for group in groups:
        for k, disc in enumerate(group.discs):
            place = drawn.add_axes(((left + k * cell) / width, (_NOTE + _BAR) / height, side / width, side / height))
            place.imshow(picture(disc.values, group.axis, PIXELS))
            place.set_title(disc.title, fontsize=8, pad=4, parse_math=False)
            place.axis("off")
        middle, long = left + (len(group.discs) * cell - _GAP) / 2, min(2.4, 0.9 * side * len(group.discs))
        _bar(drawn, group, ((middle - long / 2) / width, (_NOTE + _BAR - 0.18) / height, long / width, 0.09 / height))
        left += len(group.discs) * cell
    drawn.text(0.5, 0.07 / height, note, ha="center", fontsize=6.5, color="#676d76", parse_math=False)
    return drawn


def _bar(drawn: Figure, group: Group, place: tuple[float, float, float, float]) -> None:
    colours = ScalarMappable(LogNorm(*group.axis.ends), ListedColormap(COLOURS / 255))
    bar = Colorbar(drawn.add_axes(place), colours, orientation="horizontal", ticks=labels(group.axis))
    bar.minorticks_off()
    bar.ax.set_xticklabels([f"{value:.4g}" for value in labels(group.axis)])
    bar.ax.tick_params(labelsize=6.5, length=2, pad=2)
    bar.outline.set_visible(False)  # type: ignore[operator]  # a spine
    bar.set_label(group.label, fontsize=7, labelpad=1)
