"""Lines of errors and losses during a render: means over the seeds of a method."""

import math
import statistics
from collections.abc import Sequence

from .charts import Plot, Points, drawable
from .results import Results, Run, Summary

MOST_POINTS = 50  # points in a line of losses: each point is the mean of some training steps, because noise would hide the line


def plots(results: Results, scene: str) -> list[Plot]:
    """All charts of a scene."""
    return [*error_plots(results, scene), *loss_plots(results, scene)]


def error_plots(results: Results, scene: str) -> list[Plot]:
    """mape_display over samples, as in the slides, and relMSE over time. Empty if no run recorded errors."""
    found = results.summaries(scene)
    by_samples = [(summary.method, over(summary, "samples", "mape_display")) for summary in found]
    by_time = [(summary.method, over(summary, "seconds", "relmse")) for summary in found]
    return _drawable(
        Plot("mape", "samples per pixel", "mape_display", False, True, by_samples),
        Plot("relmse-time", "seconds, learning included", "relmse", True, True, by_time),
    )


def loss_plots(results: Results, scene: str) -> list[Plot]:
    """Losses over training steps, one plot for each kind of loss. Empty if no guide learnt."""
    plots = []
    for unit, found in by_loss(results, scene).items():
        name, lines = "-".join(["loss", *unit.removeprefix("loss of ").split()]), [(summary.method, losses(summary)) for summary in found]
        plots.append(Plot(name, "training steps", unit, False, False, lines))
    return _drawable(*plots)


def _drawable(*plots: Plot) -> list[Plot]:
    """The plots without points that cannot be drawn, without empty lines, and without empty plots."""
    found = []
    for plot in plots:
        lines = [(method, drawable(line, plot.log_x, plot.log_y)) for method, line in plot.lines]
        found.append(plot._replace(lines=[(method, line) for method, line in lines if line]))
    return [plot for plot in found if plot.lines]


def over(summary: Summary, x: str, measure: str) -> Points:
    """Errors over the means of x, "samples" per pixel or "seconds" of rendering and learning, for the passes in which every seed has an
    error.
    """
    entries = [{entry["samples"]: entry for entry in run.curve if measure in entry} for run in summary.runs]
    common = sorted(set.intersection(*map(set, entries)))
    mean = statistics.fmean
    return [(mean(seed[at][x] for seed in entries), mean(seed[at][measure] for seed in entries)) for at in common]


def losses(summary: Summary) -> Points:
    """(training steps, mean loss of a few steps), up to the end of the shortest seed."""
    means = [_mean(step) for step in zip(*(run.losses for run in summary.runs), strict=False)]
    stride = max(1, math.ceil(len(means) / MOST_POINTS))
    starts = range(0, len(means), stride)
    return [(min(start + stride, len(means)), _mean(means[start : start + stride])) for start in starts]


def _mean(values: Sequence[float]) -> float:
    """The mean of losses. Losses may be infinite, and `fmean` raises an error for these."""
    return sum(values) / len(values)


def by_loss(results: Results, scene: str) -> dict[str, list[Summary]]:
    """The methods that learnt, by the kind of their loss: only losses of one kind can be compared."""
    groups: dict[str, list[Summary]] = {}
    for summary in results.summaries(scene):
        if all(run.losses for run in summary.runs):
            groups.setdefault(_unit(summary.runs[0]), []).append(summary)
    return groups


def _unit(run: Run) -> str:
    """The kind of a run's loss. With NEE the target of a guide leaves out the lights, so its loss is another kind."""
    guide = run.settings.get("guide", {})
    error = f"{guide['error']} error" if "error" in guide else f"loss of {guide.get('kind', run.method)}"
    return f"{error} with NEE" if run.nee else error
