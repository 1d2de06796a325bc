"""The page's pictures of what is learnt: the radiance that arrives at a point, and each method's Q of it."""

from html import escape

import numpy as np

from . import discs, pictures
from .charts import Axis
from .markup import listed
from .results import Results, Run, Truth

_SIZE = 420  # pixels of a disc, along each side


def found(results: Results, scene: str) -> tuple[Truth, list[tuple[Run, np.ndarray]]] | None:
    """The truth, and the first run of each method with its Q, if it has learnt there. None without truth, or if no method learns."""
    truth, first = results.truths.get(scene), [summary.runs[0] for summary in results.summaries(scene)]
    if truth is None or not any(run.learns for run in first):
        return None
    return truth, [(run, run.learnt.q) for run in first if run.learnt and run.learnt.pixel == truth.pixel]


def verdict(run: Run, q: np.ndarray, truth: Truth) -> str:
    """How far off a run's Q is."""
    return discs.verdict(q, truth.radiance, bool(run.settings.get("nee")))


def of_scene(results: Results, scene: str) -> str:
    """The row of discs; empty where `found` is None."""
    known = found(results, scene)
    if known is None:
        return ""
    truth, learnt = known
    axis = discs.scale([truth.radiance, *(q for _, q in learnt)])
    shown = [_figure(truth.radiance, axis, "truth", "{} × {} directions".format(*truth.radiance.shape))]
    shown += [_figure(q, axis, run.method, "{} × {}, {}".format(*q.shape, verdict(run, q, truth))) for run, q in learnt]
    row = f"<div class=row>{_scale(axis)}{''.join(shown)}</div>"
    return f"<h3>What is learnt</h3>{row}<p class=note>{_about(results, scene, truth, learnt)}</p>"


def _figure(values: np.ndarray, axis: Axis, name: str, number: str) -> str:
    image = f'<img class=disc src="{pictures.uri(discs.picture(values, axis, _SIZE))}" alt="{escape(name)}">'
    return f"<figure>{image}<figcaption><b>{escape(name)}</b><br>{number}</figcaption></figure>"


def _scale(axis: Axis) -> str:
    ticks = "".join(f'<span style="left:{100 * axis.along(value):.1f}%">{value:.4g}</span>' for value in discs.labels(axis))
    return (
        f"<figure class=scale><figcaption><i></i><div class=ticks>{ticks}</div>"
        "Radiance (luminance) through each patch of the hemisphere, on one logarithmic scale.</figcaption></figure>"
    )


def _about(results: Results, scene: str, truth: Truth, learnt: list[tuple[Run, np.ndarray]]) -> str:
    """Where this is, how to read it, and which methods are not there."""
    place, (x, y) = ", ".join(f"{component:.2f}" for component in truth.position), truth.pixel
    there = {run.method for run, _ in learnt}
    lost = [s.method for s in results.summaries(scene) if s.runs[0].learns and s.method not in there]
    missing = f" No picture of {escape(listed(lost))}: nothing was learnt of that place, or it was run with another pixel." if lost else ""
    return (
        f"The light that arrives at the point ({place}) that pixel ({x}, {y}) sees, counted from the top left. The hemisphere above the "
        "surface is seen from outside: the normal in the middle, the horizon at the rim, equal areas for equal solid angles; right is "
        f"{discs.direction(truth.right)} of the world, up {discs.direction(truth.up)}. The truth is path traced, {truth.spp} samples a "
        "direction. Beside it Q, by the first seed of each method that learns, in its own patches; below it mean |Q − truth| / mean truth "
        "over these patches. With next-event estimation (NEE) Q holds only what that leaves, and is not held against the truth."
        f"{missing}"
    )
