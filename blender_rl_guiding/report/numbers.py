"""The summary table's cells, which the page and the terminal show alike."""

from collections.abc import Iterator
from typing import NamedTuple

from .results import MEASURES, Estimate, Results, Summary, ratio

EQUAL_TIME, LEARNING = "relmse, equal time", "learn share"
HEADS = (*MEASURES, EQUAL_TIME, "seconds", LEARNING, "Mrays/s")


class Cell(NamedTuple):
    """A number, half its 95 % interval and its ratio to the baseline's, as text; empty where it has none."""

    text: str
    margin: str = ""
    ratio: str = ""


def rows(results: Results, scene: str) -> Iterator[tuple[Summary, list[Cell]]]:
    """Each method's cells under `HEADS`. Ratios are left out where the baseline has no finished run on the scene."""
    base = results.base(scene)
    for summary in results.summaries(scene):
        cells = [_error(summary, base, measure) for measure in MEASURES]
        cells.append(Cell(times(equal_time(summary, base)) if base else ""))
        cells += [_cell(summary.seconds), _learning(summary), Cell(f"{summary.megarays:.2f}")]
        yield summary, cells


def _error(summary: Summary, base: Summary | None, measure: str) -> Cell:
    value = summary.errors[measure]
    return _cell(value, times(ratio(value.mean, base.errors[measure].mean)) if base else "")


def _learning(summary: Summary) -> Cell:
    """The share of the seconds that went into learning; below, those of training and inference where the guide tells them apart."""
    train, infer = summary.share("train_seconds"), summary.share("infer_seconds")
    parts = (f"{train:.0%} +", f"{infer:.0%}") if train or infer else ()
    return Cell(f"{summary.share('learn_seconds'):.0%}", *parts)


def _cell(value: Estimate, versus: str = "") -> Cell:
    return Cell(f"{value.mean:.4g}", margin(value), versus)


def margin(value: Estimate) -> str:
    """Half the 95 % interval to one digit, as in "±0.003" or "±20"; empty where there is none."""
    return "" if value.margin is None else f"±{float(f'{value.margin:.1g}'):g}"


def equal_time(summary: Summary, base: Summary) -> float:
    """The relMSE's ratio to the baseline's if both rendered equally long: relMSE falls as 1 / samples, hence as 1 / time."""
    return ratio(summary.errors["relmse"].mean, base.errors["relmse"].mean) * summary.seconds.mean / base.seconds.mean


def times(factor: float) -> str:
    """A ratio: "×0.48"."""
    return f"×{factor:.3g}"
