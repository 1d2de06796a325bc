"""The gain of an encoder: each method that has one against the same method without."""

from typing import Any

from ..tables import Cell, Row
from .numbers import margin, times
from .results import Estimate, Results, Summary, ratio_of

HEADS = ("", "against", "ratio", "")


def gains(results: Results, scene: str) -> list[Row]:
    """A row, under `HEADS`, for each pair of methods with equal settings where only one has an encoder."""
    found = results.summaries(scene)
    plain = [(summary, _but_encoder(summary)) for summary in found if _encoder(summary) == "none"]
    return [
        _row(summary, other)
        for summary in found
        if _encoder(summary) not in (None, "none")
        for other, settings in plain
        if settings == _but_encoder(summary)
    ]


def _encoder(summary: Summary) -> str | None:
    return summary.runs[0].settings["guide"].get("encoder", {}).get("kind")


def _but_encoder(summary: Summary) -> dict[str, Any]:
    """All settings that must be equal in such a pair."""
    settings = summary.runs[0].settings
    return settings | {"seed": None, "guide": settings["guide"] | {"encoder": None}}


def _row(summary: Summary, plain: Summary) -> Row:
    ratio = ratio_of(summary.errors["mape_display"], plain.errors["mape_display"])
    return Row(summary.method, (Cell(plain.method), Cell(times(ratio.mean), (margin(ratio),)), Cell(_verdict(ratio))))


def _verdict(ratio: Estimate) -> str:
    """The difference that the 95 % interval proves."""
    if ratio.margin is None:
        return "more seeds would tell"
    if (beyond := abs(ratio.mean - 1) - ratio.margin) <= 0:
        return "no difference beyond the interval"
    return f"{'better' if ratio.mean < 1 else 'worse'}, by {beyond:.1%} at least"
