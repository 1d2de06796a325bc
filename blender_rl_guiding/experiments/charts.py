"""Learning curves as inline SVG that takes its colours from the page."""

import math
from collections.abc import Sequence
from html import escape
from typing import NamedTuple

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 680, 240, 64, 12, 12, 40


class Line(NamedTuple):
    """One polyline; `colour` is a CSS colour."""

    name: str
    colour: str
    points: Sequence[tuple[float, float]]


def curves(lines: Sequence[Line], x_label: str, y_label: str) -> str:
    """A chart with a linear x axis from 0 and a logarithmic y axis; points whose y is not above 0 are left out."""
    kept = [line._replace(points=[(x, y) for x, y in line.points if y > 0 and math.isfinite(y)]) for line in lines]
    kept = [line for line in kept if line.points]
    points = [p for line in kept for p in line.points]
    if not points:
        return ""
    x_top = max(x for x, _ in points) or 1.0
    low, high = _decades([y for _, y in points])

    def place(x: float, y: float) -> tuple[float, float]:
        along, up = x / x_top, (math.log10(y) - low) / (high - low)
        return LEFT + along * (WIDTH - LEFT - RIGHT), HEIGHT - BOTTOM - up * (HEIGHT - TOP - BOTTOM)

    grid = "".join(_rule(place(0.0, y)[1], y) for y in _ticks(low, high))
    strokes = "".join(_stroke(line, [place(*p) for p in line.points]) for line in kept)
    return (
        f'<svg class="chart" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(y_label)} against {escape(x_label)}">'
        f'{grid}{strokes}<text x="{LEFT}" y="{HEIGHT - 22}">0</text>'
        f'<text x="{WIDTH - RIGHT}" y="{HEIGHT - 22}" text-anchor="end">{x_top:,.4g}</text>'
        f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 4}" text-anchor="middle">{escape(x_label)}</text></svg>'
    )


def _decades(values: Sequence[float]) -> tuple[float, float]:
    """The y axis' ends as powers of ten, with a little room."""
    low, high = math.log10(min(values)), math.log10(max(values))
    room = max(0.05 * (high - low), 0.05)
    return low - room, high + room


def _ticks(low: float, high: float) -> list[float]:
    """1, 2 and 5 times powers of ten between the ends; only the powers where that would be crowded."""
    steps = (1, 2, 5) if high - low < 2.5 else (1,)
    every = [step * 10.0**decade for decade in range(math.floor(low), math.ceil(high) + 1) for step in steps]
    return [y for y in every if low <= math.log10(y) <= high]


def _rule(y: float, value: float) -> str:
    label = f'<text x="{LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>'
    return f'<path class="grid" d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}"/>{label}'


def _stroke(line: Line, points: Sequence[tuple[float, float]]) -> str:
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{path}" style="stroke:{escape(line.colour)}"><title>{escape(line.name)}</title></polyline>'
