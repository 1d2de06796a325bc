"""The report's tables of numbers: errors of a scene, their means over all scenes, every run, and errors for papers."""

from collections.abc import Sequence

from ..measures import NAMES
from ..tables import Cell, Row, Table
from .results import COLUMNS, Estimate, Results, Summary, geometric_mean, ratio

EQUAL_TIME, LEARNING = "relmse, equal time", "learn share"
HEADS = ("", *NAMES, EQUAL_TIME, "seconds", LEARNING, "Mrays/s")


def errors(results: Results, scene: str) -> list[Row]:
    """Each method's cells under `HEADS`. Without a finished run of the baseline on the scene, ratios are left out."""
    found, base = results.summaries(scene), results.base(scene)
    return [Row(summary.method, [*_errors(summary, found, base), *_costs(summary, base)]) for summary in found]


def _errors(summary: Summary, found: Sequence[Summary], base: Summary | None) -> list[Cell]:
    """A cell for each measure: the error, and below it its interval and error / error of the baseline."""
    cells = []
    for name in NAMES:
        value, means = summary.errors[name], [other.errors[name].mean for other in found]
        versus = times(ratio(value.mean, base.errors[name].mean)) if base else ""
        mark = "best" if value.mean == min(means) else None
        share = 100 * value.mean / max(means) if max(means) else 0.0
        cells.append(Cell(f"{value.mean:.4g}", (margin(value), versus), mark, share))
    return cells


def _costs(summary: Summary, base: Summary | None) -> list[Cell]:
    seconds = Cell(f"{summary.seconds.mean:.4g}", (margin(summary.seconds),))
    equal = Cell(times(equal_time(summary, base)) if base else "", ())
    return [equal, seconds, _learning(summary), Cell(f"{summary.megarays:.2f}", ())]


def _learning(summary: Summary) -> Cell:
    """Learning time / seconds. Below it, the shares of training and of inference, if the guide measures both."""
    train, infer = summary.share("train_seconds"), summary.share("infer_seconds")
    parts = (f"{train:.0%} +", f"{infer:.0%}") if train or infer else ()
    return Cell(f"{summary.share('learn_seconds'):.0%}", parts)


def overall(results: Results, scenes: Sequence[Sequence[Summary]]) -> Table:
    """Geometric means of the ratios to the baseline, over the scenes with results of every method."""
    base, rows = results.methods.index(results.baseline), []
    for k, method in enumerate(results.methods):
        means = [geometric_mean(ratio(s[k].errors[name].mean, s[base].errors[name].mean) for s in scenes) for name in NAMES]
        means.append(geometric_mean(equal_time(s[k], s[base]) for s in scenes))
        rows.append(Row(method, [Cell(times(mean)) for mean in means]))
    return Table(("", *NAMES, EQUAL_TIME), {"": rows})


def runs(results: Results) -> Table:
    """A row for each scene, method and seed."""
    rows = {scene: [run.row for run in results.runs if run.scene == scene] for scene in results.scenes}
    return Table(COLUMNS[1:], {scene: [Row(row[1], [Cell(str(value)) for value in row[2:]]) for row in rows[scene]] for scene in rows})


def papers(results: Results) -> Table:
    """mape_display with half its 95 % interval, and mape_display / mape_display of the baseline. The best of each scene is marked."""
    columns = [_column(results, scene) for scene in results.reported]
    rows = [Row(method, [column.get(method, Cell("--")) for column in columns]) for method in results.methods]
    return Table(("mape_display", *results.reported), {"": rows})


def _column(results: Results, scene: str) -> dict[str, Cell]:
    """The cells of a scene by method."""
    errors, base = {summary.method: summary.errors["mape_display"] for summary in results.summaries(scene)}, results.baseline
    best, cells = min(error.mean for error in errors.values()), {}
    for method, error in errors.items():
        below = [] if error.margin is None else [f"±{error.margin:.4f}"]
        below += [f"(×{ratio(error.mean, errors[base].mean):.3f})"] if base in errors else []
        cells[method] = Cell(f"{error.mean:.4f}", below, "best" if error.mean == best else None)
    return cells


def margin(value: Estimate) -> str:
    """Half the 95 % interval to one digit, as in "±0.003" or "±20"; empty if there is none."""
    return "" if value.margin is None else f"±{float(f'{value.margin:.1g}'):g}"


def equal_time(summary: Summary, base: Summary) -> float:
    """relMSE / relMSE of the baseline if both rendered for the same time. relMSE falls as 1 / samples, hence as 1 / time."""
    return ratio(summary.errors["relmse"].mean, base.errors["relmse"].mean) * summary.seconds.mean / base.seconds.mean


def times(factor: float) -> str:
    """A ratio: "×0.48"."""
    return f"×{factor:.3g}"
