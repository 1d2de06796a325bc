"""The results of the slides "Deep Reinforcement Learning and Ray Tracing": errors at 32 samples per pixel, training included."""

from ..tables import Cell, Row
from .numbers import margin
from .results import Results, Summary, ratio_of

SPP = 32
PRECISION = 0.02  # of the ratios: we measured them from the JPEG images in the slides

# mape_display from the slides' final table.
ERRORS = {
    "c1": {"uniform": 0.41189, "slides_c_dqn": 0.32089, "slides_c_rbf": 0.31474, "slides_c_bspline": 0.30777},
    "c2": {"uniform": 0.12705, "slides_c_dqn": 0.10882, "slides_c_rbf": 0.10823, "slides_c_bspline": 0.10827},
    "c3": {"uniform": 0.41874, "slides_c_dqn": 0.38466, "slides_c_rbf": 0.37741, "slides_c_bspline": 0.37414},
}

# mape_display / mape_display of `uniform`, +- PRECISION.
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
EXPERIMENTS = ("slides-a", "slides-b", "slides-c")  # experiments of the catalogue with these scenes and methods
HEADS = ("", "published", "ours", "reached?")


def rows(results: Results, scene: str) -> list[Row]:
    """Each of our methods beside the published method, under `HEADS`. Empty if nothing is published, or if our baseline is missing."""
    base = results.base(scene)
    if results.name not in EXPERIMENTS or scene not in RATIOS or base is None:
        return []
    return [_row(scene, summary, base) for summary in results.summaries(scene)]


def _row(scene: str, summary: Summary, base: Summary) -> Row:
    method, error = summary.method, summary.errors["mape_display"]
    ours, theirs = ratio_of(error, base.errors["mape_display"]), RATIOS[scene]
    if method in theirs:
        verdict = _verdict(ours.mean, theirs[method])
    elif method == base.method:
        verdict = ""
    else:
        verdict = f"×{ours.mean / min(theirs.values()):.2f} of their best"
    published = f"×{theirs[method]:.3f}" if method in theirs else "–"
    printed = ERRORS.get(scene, {}).get(method)
    cells = (
        Cell(published, None if printed is None else (f"{printed:.4f}",)),
        Cell(f"×{ours.mean:.3f}", (margin(ours), f"{error.mean:.4f}")),
        Cell(verdict, mark={"yes": "best", "no": "worse"}.get(verdict, "")),
    )
    return Row(method, cells)


def _verdict(ours: float, theirs: float) -> str:
    if ours <= theirs:
        return "yes"
    return f"within ±{PRECISION}" if ours <= theirs + PRECISION else "no"
