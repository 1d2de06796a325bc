"""What the slides "Deep Reinforcement Learning and Ray Tracing" report, as data: errors at 32 samples per pixel, training included."""

from typing import NamedTuple

from .results import Estimate, Results, Summary, ratio_of

SPP = 32
PRECISION = 0.02  # of the ratios: they were measured from the images inside the slides, which are JPEG

# mape_display as the slides' final table prints it.
ERRORS = {
    "c1": {"uniform": 0.41189, "slides_c_dqn": 0.32089, "slides_c_rbf": 0.31474, "slides_c_bspline": 0.30777},
    "c2": {"uniform": 0.12705, "slides_c_dqn": 0.10882, "slides_c_rbf": 0.10823, "slides_c_bspline": 0.10827},
    "c3": {"uniform": 0.41874, "slides_c_dqn": 0.38466, "slides_c_rbf": 0.37741, "slides_c_bspline": 0.37414},
}

# mape_display over that of `uniform`, +- PRECISION.
RATIOS = {
    "a1": {"slides_a_dqn": 0.658, "slides_a_pos": 0.646},
    "a2": {"slides_a_dqn": 0.776, "slides_a_pos": 0.788},
    "a3": {"slides_a_dqn": 0.877, "slides_a_pos": 0.891},
    "b1": {"slides_b_cdqn": 0.936, "slides_b_rbf": 0.921},
    "b2": {"slides_b_cdqn": 0.867, "slides_b_rbf": 0.832},
    "b3": {"slides_b_cdqn": 0.935, "slides_b_rbf": 0.914},
    "c1": {"slides_c_dqn": 0.788, "slides_c_rbf": 0.773, "slides_c_bspline": 0.758},
    "c2": {"slides_c_dqn": 0.856, "slides_c_rbf": 0.850, "slides_c_bspline": 0.853},
    "c3": {"slides_c_dqn": 0.925, "slides_c_rbf": 0.911, "slides_c_bspline": 0.904},
}
EXPERIMENTS = ("slides-a", "slides-b", "slides-c")  # of the catalogue, which have these scenes and methods


class Row(NamedTuple):
    """One method on one scene, theirs beside ours."""

    method: str
    ratio: float | None  # published
    error: float | None  # published
    our_ratio: Estimate
    our_error: Estimate
    verdict: str


def rows(results: Results, scene: str) -> list[Row]:
    """Every method of ours beside what is published of it; empty where nothing is, or our baseline is missing."""
    base = results.base(scene)
    if results.name not in EXPERIMENTS or scene not in RATIOS or base is None:
        return []
    return [_row(scene, summary, base) for summary in results.summaries(scene)]


def _row(scene: str, summary: Summary, base: Summary) -> Row:
    method, error = summary.method, summary.errors["mape_display"]
    ours, theirs = ratio_of(error, base.errors["mape_display"]), RATIOS[scene].get(method)
    if theirs is not None:
        verdict = _verdict(ours.mean, theirs)
    elif method == base.method:
        verdict = ""
    else:
        verdict = f"×{ours.mean / min(RATIOS[scene].values()):.2f} of their best"
    return Row(method, theirs, ERRORS.get(scene, {}).get(method), ours, error, verdict)


def _verdict(ours: float, theirs: float) -> str:
    if ours <= theirs:
        return "yes"
    return f"within ±{PRECISION}" if ours <= theirs + PRECISION else "no"
