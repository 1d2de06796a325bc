"""Line charts as inline SVG that takes its colours from the page."""

import math
from collections.abc import Callable, Sequence
from html import escape
from typing import NamedTuple

LARGEST = 1e30  # largest value in a chart; the smallest value on a logarithmic axis is 1 / LARGEST
NARROWEST = 1e-9  # minimal span of an axis, relative to its largest value; with less, the labels of ticks would be equal
Points = Sequence[tuple[float, float]]
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 680, 340, 70, 16, 34, 56


class Axis(NamedTuple):
    """The numbers along one side of a chart, from `low` to `high`; on a logarithmic axis these are exponents of ten."""

    log: bool
    low: float
    high: float

    def along(self, value: float) -> float:
        """The position of a value along the axis, 0..1."""
        return ((math.log10(value) if self.log else value) - self.low) / (self.high - self.low)

    @property
    def ends(self) -> tuple[float, float]:
        """The values at both ends."""
        return (10.0**self.low, 10.0**self.high) if self.log else (self.low, self.high)

    def ticks(self) -> list[float]:
        """About four to eight round numbers within the axis."""
        if not self.log:
            step = round_step((self.high - self.low) / 5)
            return [k * step for k in range(math.ceil(self.low / step), math.floor(self.high / step) + 1)]
        steps = (1, 2, 5) if self.high - self.low < 2.5 else (1,)
        every = [step * 10.0**decade for decade in range(math.floor(self.low), math.ceil(self.high) + 1) for step in steps]
        return [value for value in every if self.low <= math.log10(value) <= self.high]


def axis(values: Sequence[float], log: bool) -> Axis:
    """An axis that holds all values, at least one, with a little room."""
    low, high = (math.log10(v) if log else v for v in (min(values), max(values)))
    size = 1.0 if log else max(abs(low), abs(high))
    alike = high - low <= max(NARROWEST * size, 1 / LARGEST)
    room = 0.05 * (size if alike else high - low)
    if room <= 0.05 / LARGEST:
        room = 1.0
    return Axis(log, low - room, high + room)


class Plot(NamedTuple):
    """Lines over common axes, for the page and for the figures for papers."""

    name: str  # the name as a part of file names
    x_label: str
    y_label: str
    log_x: bool
    log_y: bool
    lines: Sequence[tuple[str, Points]]  # by method; none is empty, and all points are `drawable`

    @property
    def axes(self) -> tuple[Axis, Axis]:
        """The horizontal and the vertical axis."""
        points = [point for _, line in self.lines for point in line]
        return axis([x for x, _ in points], self.log_x), axis([y for _, y in points], self.log_y)


def round_step(step: float) -> float:
    """1, 2 or 5 times a power of ten, at least `step`."""
    decade = 10.0 ** math.floor(math.log10(step))
    return next(k * decade for k in (1, 2, 5, 10) if k * decade >= step * 0.999)


def drawable(points: Points, log_x: bool, log_y: bool) -> list[tuple[float, float]]:
    """The points that can be drawn in a chart."""

    def has_place(value: float, log: bool) -> bool:
        return 1 / LARGEST < value < LARGEST if log else abs(value) < LARGEST

    return [(x, y) for x, y in points if has_place(x, log_x) and has_place(y, log_y)]


def chart(plot: Plot, colour: Callable[[str], str]) -> str:
    """The lines over a grid; `colour` is the CSS colour of a method."""
    axes = plot.axes
    strokes = "".join(_stroke(name, colour(name), [_place(*axes, *point) for point in points]) for name, points in plot.lines)
    names = escape(f"{plot.y_label} against {plot.x_label}")
    return (
        f'<svg class="chart" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{names}">{_grid(*axes)}{strokes}'
        f'<text x="0" y="18">{escape(plot.y_label)}</text>'
        f'<text x="{WIDTH - RIGHT}" y="{HEIGHT - 6}" text-anchor="end">{escape(plot.x_label)}</text></svg>'
    )


def _place(x_axis: Axis, y_axis: Axis, x: float, y: float) -> tuple[float, float]:
    return LEFT + x_axis.along(x) * (WIDTH - LEFT - RIGHT), HEIGHT - BOTTOM - y_axis.along(y) * (HEIGHT - TOP - BOTTOM)


def _grid(x_axis: Axis, y_axis: Axis) -> str:
    bottom, parts = HEIGHT - BOTTOM, []
    for value in y_axis.ticks():
        y = bottom - y_axis.along(value) * (bottom - TOP)
        parts.append(f'<path class="grid" d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}"/>')
        parts.append(f'<text x="{LEFT - 8}" y="{y + 5:.1f}" text-anchor="end">{value:.4g}</text>')
    for value in x_axis.ticks():
        x = LEFT + x_axis.along(value) * (WIDTH - LEFT - RIGHT)
        parts.append(
            f'<path class="grid" d="M{x:.1f} {bottom}v5"/><text x="{x:.1f}" y="{bottom + 23}" text-anchor="middle">{value:.4g}</text>'
        )
    return "".join(parts)


def _stroke(name: str, colour: str, points: Points) -> str:
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{path}" style="stroke:{escape(colour)}"><title>{escape(name)}</title></polyline>'
