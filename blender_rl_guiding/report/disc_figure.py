"""Hemispheres as a figure: discs in a row, each group with a bar of its colours below."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure

from . import discs
from .charts import Axis
from .pictures import COLOURS

PIXELS = 480  # of a disc, along each side
_GAP, _TITLE, _BAR, _NOTE = 0.12, 0.4, 0.52, 0.26  # inches: between discs, above them, below them, at the bottom
_LETTER = 0.05  # inches, of the line at the bottom, about


class Disc(NamedTuple):
    """A hemisphere (rows, columns) and what stands above it, in one line or two."""

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
            place.imshow(discs.picture(disc.values, group.axis, PIXELS))
            place.set_title(disc.title, fontsize=8, pad=4, parse_math=False)
            place.axis("off")
        middle, long = left + (len(group.discs) * cell - _GAP) / 2, min(2.4, 0.9 * side * len(group.discs))
        _bar(drawn, group, ((middle - long / 2) / width, (_NOTE + _BAR - 0.18) / height, long / width, 0.09 / height))
        left += len(group.discs) * cell
    drawn.text(0.5, 0.07 / height, note, ha="center", fontsize=6.5, color="#676d76", parse_math=False)
    return drawn


def _bar(drawn: Figure, group: Group, place: tuple[float, float, float, float]) -> None:
    colours = ScalarMappable(LogNorm(*group.axis.ends), ListedColormap(COLOURS / 255))
    bar = Colorbar(drawn.add_axes(place), colours, orientation="horizontal", ticks=discs.labels(group.axis))
    bar.minorticks_off()
    bar.ax.set_xticklabels([f"{value:.4g}" for value in discs.labels(group.axis)])
    bar.ax.tick_params(labelsize=6.5, length=2, pad=2)
    bar.outline.set_visible(False)  # type: ignore[operator]  # a spine
    bar.set_label(group.label, fontsize=7, labelpad=1)
