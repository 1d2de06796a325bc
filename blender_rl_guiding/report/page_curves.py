"""The page's charts of a scene: errors over samples and over time, and losses over training steps."""

from collections.abc import Sequence

from . import curves
from .charts import Line, chart
from .markup import colour, legend
from .results import Results


def errors(results: Results, scene: str) -> str:
    """Charts of the errors; empty where no run recorded them."""
    note = "Means over the seeds, against the reference, while the image renders: at equal samples, and at equal time."
    return _section("Error", note, results, curves.error_plots(results, scene))


def losses(results: Results, scene: str) -> str:
    """Charts of the loss of what learns; empty where nothing learnt."""
    note = "Means over the seeds and over a few steps each. Losses of different kinds are apart, for they cannot be compared."
    return _section("Loss", note, results, curves.loss_plots(results, scene))


def _section(title: str, note: str, results: Results, plots: Sequence[curves.Plot]) -> str:
    drawn = [f"<div>{legend(results, [method for method, _ in plot.lines])}{_chart(results, plot)}</div>" for plot in plots]
    return f"<h3>{title}</h3><p class=note>{note}</p><div class=charts>{''.join(drawn)}</div>" if drawn else ""


def _chart(results: Results, plot: curves.Plot) -> str:
    lines = [Line(method, colour(results, method), points) for method, points in plot.lines]
    return chart(lines, plot.x_label, plot.y_label, log_x=plot.log_x, log_y=plot.log_y)
