"""The page's charts of a scene: errors over samples and over time, and losses over training steps."""

from collections.abc import Callable, Sequence

from . import curves
from .charts import Line, chart
from .markup import colour, legend
from .results import Results, Summary


def errors(results: Results, scene: str) -> str:
    """mape_display over samples as the slides have it, and relMSE over time; empty where no run recorded them."""
    found = results.summaries(scene)
    by_samples = chart(
        _lines(results, found, lambda s: curves.over_samples(s, "mape_display")), "samples per pixel", "mape_display", log_y=True
    )
    by_time = chart(
        _lines(results, found, lambda s: curves.over_seconds(s, "relmse")), "seconds, learning included", "relmse", log_x=True, log_y=True
    )
    if not by_samples:
        return ""
    note = "Means over the seeds, against the reference, while the image renders: at equal samples, and at equal time."
    names = legend(results, [summary.method for summary in found])
    return f"<h3>Error</h3><p class=note>{note}</p>{names}<div class=charts>{by_samples}{by_time}</div>"


def losses(results: Results, scene: str) -> str:
    """The loss of what learns, a chart for each kind of loss; empty where nothing learnt."""
    charts = []
    for unit, found in curves.by_loss(results, scene).items():
        drawn = chart(_lines(results, found, curves.losses), "training steps", unit)
        if drawn:
            charts.append(f"<div>{legend(results, [summary.method for summary in found])}{drawn}</div>")
    if not charts:
        return ""
    note = "Means over the seeds and over a few steps each. Losses of different kinds are apart, for they cannot be compared."
    return f"<h3>Loss</h3><p class=note>{note}</p><div class=charts>{''.join(charts)}</div>"


def _lines(results: Results, found: Sequence[Summary], points: Callable[[Summary], curves.Points]) -> list[Line]:
    return [Line(summary.method, colour(results, summary.method), points(summary)) for summary in found]
