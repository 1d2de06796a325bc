"""What an encoder gains: each method that has one against the same method without."""

from typing import Any, NamedTuple

from .results import Estimate, Results, Summary, ratio_of


class Gain(NamedTuple):
    """One method with an encoder on one scene."""

    method: str
    plain: str  # the method without an encoder
    ratio: Estimate  # of their mape_display
    verdict: str


def gains(results: Results, scene: str) -> list[Gain]:
    """All that can be told apart from the experiment's own methods."""
    found = results.summaries(scene)
    plain = [(summary, _but_encoder(summary)) for summary in found if _encoder(summary) == "none"]
    return [
        _gain(summary, other)
        for summary in found
        if _encoder(summary) not in (None, "none")
        for other, settings in plain
        if settings == _but_encoder(summary)
    ]


def _encoder(summary: Summary) -> str | None:
    return summary.runs[0].settings["guide"].get("encoder", {}).get("kind")


def _but_encoder(summary: Summary) -> dict[str, Any]:
    """The settings that must agree."""
    settings = summary.runs[0].settings
    return settings | {"seed": None, "guide": settings["guide"] | {"encoder": None}}


def _gain(summary: Summary, plain: Summary) -> Gain:
    ratio = ratio_of(summary.errors["mape_display"], plain.errors["mape_display"])
    return Gain(summary.method, plain.method, ratio, _verdict(ratio))


def _verdict(ratio: Estimate) -> str:
    """What is sure at 95 %."""
    if ratio.margin is None:
        return "more seeds would tell"
    if (beyond := abs(ratio.mean - 1) - ratio.margin) <= 0:
        return "no difference beyond the interval"
    return f"{'better' if ratio.mean < 1 else 'worse'}, by {beyond:.1%} at least"
